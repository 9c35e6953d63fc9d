"""One reader a file format: C3D, TRC, MOT and STO, CSV."""

"""Marker sets: which markers a laboratory may have, on which segments, and landmarks by them."""

"""The slow, obvious NumPy reference that the compiled core is compared with.

Written from the paper's equations and textbook mechanics alone, and on purpose in another form than the core:
classical Newton-Euler in the ground frame, dense matrices, Jacobians by the complex step.
"""

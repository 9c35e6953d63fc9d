"""What is known of the ground before a run: who stands on what, and whether plates, feet and motion agree.

`known.known_ground` is what a run asks: plates are put to zero and brought into step (`delay`, `fine_delay`); who
stands where (`on_ground`) is judged (`judged`) by what the motion needs of the ground (`needed`, `closure`), which also
says how far sensors are off (`plate_errors`), asked in the order of `rate`, `carried`, `shear`, `gain` and `turn`.
What the whole body needs by inverse kinematics (`stretches`) is asked by `fine_delay` and `turn`.
What is known then is one value (`ground.Ground`), live as in files; `expected` says what each contact may bear by it.
"""

"""What is known of the ground before a run: who stands on what, and whether plates, feet and motion agree.

`known.known_ground` is what a run asks: plates are put to zero, brought into step (`coarse_delay`, `fine_delay`), and
judged (`judged`) by what the motion needs of the ground (`needed`, `closure`), each kind of error in a room of its own.
`expected` says what each contact may bear meanwhile.
"""

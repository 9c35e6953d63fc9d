"""How sure an estimate is, with what the filter cannot know.

`frames` is what that is worked out from, of a recording as of a live session. Each kind of error has a class that says
what errors of size 1 do in a frame: `joints`, `skin`, `mass_centres`, `loads`, `inertia`; `sizes` says how large they
are. `systematic` adds them up, and `reported` with the part of the filter's own variance that holds for the movement.
`low_pass` widens that where the markers were low-passed before.
"""

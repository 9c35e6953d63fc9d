"""How sure the filter's estimate is, with what the filter cannot know.

`systematic` works out, by kind of error, what joints, skin, limbs, centres of mass and loads that are not as the model
has them do to what is estimated; `sizes` says how large these errors are, `reported` adds them to the part of the
filter's own variance that holds for the movement. `low_pass` widens what somebody has low-passed before.
"""

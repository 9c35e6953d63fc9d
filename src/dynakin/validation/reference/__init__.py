"""What dynakin is compared with: classical joint angles, low-pass and derivatives, the table's wrench and moments
("AT"), and offline least squares. Plain NumPy and SciPy, nothing of the compiled core."""

from dynakin.validation.reference.base_parameters import BaseParameters
from dynakin.validation.reference.chain import Kinematics, PlanarChain
from dynakin.validation.reference.classical import classical_angles
from dynakin.validation.reference.least_squares import LeastSquares, identify
from dynakin.validation.reference.methods import Reference, reference_methods
from dynakin.validation.reference.regressor import ChainDynamics, table_dynamics

__all__ = [
    "BaseParameters",
    "ChainDynamics",
    "Kinematics",
    "LeastSquares",
    "PlanarChain",
    "Reference",
    "classical_angles",
    "identify",
    "reference_methods",
    "table_dynamics",
]

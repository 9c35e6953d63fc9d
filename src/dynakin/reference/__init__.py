"""What dynakin is compared with: classical joint angles, low-pass and derivatives, the table's wrench and moments
("AT"), and offline least squares. Plain NumPy and SciPy, nothing of the compiled core."""

from dynakin.recordings.smoothing import CUTOFF_HZ, Smoothed, smooth
from dynakin.reference.base_parameters import BaseParameters
from dynakin.reference.chain import Kinematics, PlanarChain
from dynakin.reference.classical import classical_angles
from dynakin.reference.condensed import DECLARED_SIGMA
from dynakin.reference.identification import Identification, bodies_of, identify, predicted_wrench
from dynakin.reference.landmark_paths import landmark_paths
from dynakin.reference.methods import Reference, reference_methods
from dynakin.reference.table_dynamics import ChainDynamics, table_dynamics

__all__ = [
    "CUTOFF_HZ",
    "DECLARED_SIGMA",
    "BaseParameters",
    "ChainDynamics",
    "Identification",
    "Kinematics",
    "PlanarChain",
    "Reference",
    "Smoothed",
    "bodies_of",
    "classical_angles",
    "identify",
    "landmark_paths",
    "predicted_wrench",
    "reference_methods",
    "smooth",
    "table_dynamics",
]

def built() -> list[str]:
    """The levels that the core was compiled for, widest first."""

def has(level: str) -> bool:
    """
    Whether this processor can run a core compiled for 'v4' (AVX-512), 'v3' (AVX2) or 'baseline'.
    """

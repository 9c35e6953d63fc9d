level: str = 'x86-64-v3'

def supported() -> bool:
    """Whether this processor can run the core."""

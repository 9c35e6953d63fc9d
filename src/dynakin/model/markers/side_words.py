"""Words for right and left in names of markers, in several languages."""

from __future__ import annotations

LONG_SIDE_WORDS = {
    "right": (
        "right",
        "rechts",
        "derecha",
        "derecho",
        "rechter",
        "direita",
        "direito",
        "droite",
        "droit",
        "destro",
        "destra",
        "rt",
        "dx",
        "r",
    ),
    "left": (
        "left",
        "links",
        "izquierda",
        "izquierdo",
        "linker",
        "esquerda",
        "esquerdo",
        "gauche",
        "sinistro",
        "sinistra",
        "lt",
        "sx",
        "l",
    ),
}
SHORT_SIDE_WORDS = {"right": ("re", "d"), "left": ("li", "g")}
"""German and French: only where nothing else says the side, and a letter only behind a place or a French segment: d
elsewhere counts the markers of a cluster."""
SIDE_WORDS = frozenset(word for words in (LONG_SIDE_WORDS, SHORT_SIDE_WORDS) for own in words.values() for word in own)
"""Words for right and left in all languages that names are read in."""

"""Textured boards: bumps, plates to print, how rough they feel, and designs. Millimetres, degrees from the long axis."""

from ._hwall import Patch, Texture, design

__all__ = ["Patch", "Texture", "design"]

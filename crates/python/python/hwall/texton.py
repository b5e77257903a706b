"""Textured boards: bumps, plates to print, predicted roughness, and designs. Millimetres, degrees from the long axis."""

from ._hwall import Patch, Texture, design

__all__ = ["Patch", "Texture", "design"]

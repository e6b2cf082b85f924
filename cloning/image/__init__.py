"""Expression analogy in pictures."""

from __future__ import annotations

from cloning.image.analogy import METHODS, Analogy, Method
from cloning.image.picture import AnalogyResult, Picture
from cloning.image.points import Places

__all__ = ["METHODS", "Analogy", "AnalogyResult", "Method", "Picture", "Places"]

"""The page of a reproduction and its figures as PNG; nothing is computed here."""

from studies.van_de_wijdeven.page.page import own_sections, reproduction_page
from studies.van_de_wijdeven.page.pictures import picture

__all__ = ["own_sections", "picture", "reproduction_page"]

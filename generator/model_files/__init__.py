"""Figures in the formats of other programs: one format a module, each with a report of losses."""

from generator.losses import Loss, Losses

__all__ = ["Loss", "Losses"]

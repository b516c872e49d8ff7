"""Pictures of runs, drawn with matplotlib into files, never on a screen."""

from viapoint.runtime.pictures.sheet import PictureError, draw_run

__all__ = ["PictureError", "draw_run"]

"""The panels of the page, in the order of their tabs."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from generator.viewer.body_panel import BodyPanel
from generator.viewer.curve_panel import CurvePanel
from generator.viewer.pose_panel import PosePanel

if TYPE_CHECKING:
    from collections.abc import Callable

    from generator.viewer.viewer import Panel, Viewer

PANELS: "Sequence[Callable[[Viewer], Panel]]" = (
    PosePanel,
    BodyPanel,
    CurvePanel,
)

"""A rendering's place on its photograph's grid, or the reason why the two cannot be compared."""

from __future__ import annotations

from documents import Finding
from stimuli.comparison.chart_way import Side, check_charts
from stimuli.comparison.errors import PictureError
from stimuli.comparison.pictures import View
from stimuli.comparison.place_regions import corner_pairs, place_regions
from stimuli.comparison.placing import Placing, place
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.results import Wishes
from stimuli.comparison.row_file import RowFile
from stimuli.errors import StimulusError

# A rendering that is turned further was made another way round, and is not turned back for anyone.
MOST_TURN_DEG = 45.0


def registered(photo: View, rendering: View, file: str, regions: RegionsFile, wishes: Wishes) -> Placing:
    """Return where the rendering, of the file named, lies.

    Raises
    ------
    StimulusError, PictureError
        If that is not known closely enough, or a chart lies another way round.
    """
    try:
        return _placed(photo.xyz, rendering.xyz, file, regions, wishes)
    except StimulusError:
        _refuse_turned_charts(photo, rendering, regions)
        raise


def _placed(photo: RowFile, rendering: RowFile, file: str, regions: RegionsFile, wishes: Wishes) -> Placing:
    """Return where the rendering lies, refusing it if that is not known closely enough."""
    corners = wishes.corners_px
    if wishes.registering == "corners" and corners is None:
        corners = corner_pairs(regions, photo.shape, rendering.shape)
        if corners is None:
            raise StimulusError(
                Finding(
                    "no corners are given for both pictures",
                    regions.file,
                    remedy="give 'corners' and 'rendering_corners', or say --photo-corners and --rendering-corners",
                )
            )
    # Regions count from the corner of a pixel, alignment from its middle.
    halved = None if corners is None else (corners[0] - 0.5, corners[1] - 0.5)
    placing = place(photo, rendering, wishes.registering, halved)
    if abs(placing.rotation_deg) > MOST_TURN_DEG:
        raise StimulusError(
            Finding(
                f"the rendering is turned by {placing.rotation_deg:.1f}° against the photograph",
                file,
                remedy="turn it upright, or give corners that say so",
            )
        )
    most = regions.limits.registration_residual_px
    if placing.residual_px is not None and placing.residual_px > most:
        told = "; ".join(placing.sentences())
        raise StimulusError(
            Finding(
                f"photograph and rendering lie {placing.residual_px:.2g} px apart, more than {most:g} px"
                + (f": {told}" if told else ""),
                file,
                remedy="let them be registered with --register auto"
                if wishes.registering == "none"
                else "check that they show the same; or raise the limit 'registration_residual_px'",
            )
        )
    return placing


def _refuse_turned_charts(photo: View, rendering: View, regions: RegionsFile) -> None:
    """Where two pictures of one size do not fit, say so if that is because a chart lies another way round."""
    if photo.xyz.shape != rendering.xyz.shape:
        return
    charts = place_regions(regions, photo.xyz.shape).charts
    sides: tuple[tuple[View, Side], ...] = ((photo, "photograph"), (rendering, "rendering"))
    for view, side in sides:
        try:
            check_charts(view.xyz, charts, side, view.saturated, regions.file)
        except PictureError as error:
            # That the colours are in no way the chart's is no news of pictures that do not fit.
            turned = [one for one in error.findings if one.message.startswith("the chart ")]
            if turned:
                raise PictureError(turned) from None

"""The waist's passive torque in bending forward and back (the thesis's figure 4.12)."""

from plots.curve_claims import late_stop, near, printed_holds, read_out, same_way, stops
from plots.curve_plate import curve_plate
from plots.joint_curve import read_curve
from plots.literature import compared, joined, published_curve
from plots.moment_axes import Window
from plots.plate import Plate
from plots.waist_bend import WORDS

_WINDOW = Window(angles=(-60.0, 100.0), torques=(-90.0, 90.0), residuals=(-90.0, 40.0))


def plate() -> Plate:
    """Draw the plate."""
    curve = read_curve("waist", "flexion")
    schmidt = compared(
        joined(
            published_curve("schmidt_1998/flexion", "Schmidt 1998, lumbar spine"),
            published_curve("schmidt_1998/extension", "Schmidt 1998, lumbar spine"),
        )
    )
    han = compared(published_curve("han_2010/flexion", "Han 2010, lumbar spine, flexion only"))
    anderson = compared(published_curve("anderson_1999/lumbar_extension", "Anderson 1999, limits"))
    low, high = curve.normal
    zone = curve.cubic.dead_zone
    assert zone is not None
    early = "a spine that bends forward by 80 deg is stopped here at 56"
    claims = [
        *read_out(curve),
        printed_holds(curve),
        late_stop(curve, early),
        stops(curve, "extension is held 19 deg beyond the normal end only"),
        near(
            curve,
            schmidt,
            low,
            zone[1],
            f"all of it is in the dead zone; those spines hold {abs(schmidt.at(zone[1])):.0f} N m "
            "where it ends",
        ),
        near(curve, schmidt, low, high, early),
        near(curve, han, 0.0, high, early),
        same_way(curve, schmidt, low, high),
    ]
    title = "Waist, bent forward (the thesis's figure 4.12)"
    literature = [schmidt, han, anderson]
    return curve_plate("waist_flexion", title, curve, literature, _WINDOW, claims, WORDS)

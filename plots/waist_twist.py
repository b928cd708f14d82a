"""The waist's passive torque in twisting (the thesis's figure 4.13)."""

from plots.curve_claims import near, printed_holds, read_out, stops
from plots.curve_plate import curve_plate
from plots.joint_curve import read_curve
from plots.literature import compared, published_curve
from plots.moment_axes import Window
from plots.plate import Plate
from plots.waist_bend import WORDS

_WINDOW = Window(angles=(-85.0, 85.0), torques=(-90.0, 90.0), residuals=(-60.0, 60.0))


def plate() -> Plate:
    """Draw the plate."""
    curve = read_curve("waist", "twist to the left")
    schmidt = compared(published_curve("schmidt_1998/axial_rotation", "Schmidt 1998, lumbar spine"))
    han = compared(published_curve("han_2010/axial_rotation", "Han 2010, lumbar spine"))
    anderson = compared(published_curve("anderson_1999/lumbar_rotation", "Anderson 1999, limits"))
    free = "its dead zone of 139 deg is wider than any spine turns"
    claims = [
        *read_out(curve),
        printed_holds(curve),
        stops(curve, free),
        near(curve, schmidt, *curve.normal, free),
        near(curve, han, *curve.normal, free),
    ]
    title = "Waist, twisted (the thesis's figure 4.13)"
    literature = [schmidt, han, anderson]
    return curve_plate("waist_twist", title, curve, literature, _WINDOW, claims, WORDS)

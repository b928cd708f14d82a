"""Every published row against a number worked from the formula as the publication prints it.

The arithmetic here is in the printed units and senses; only its result is turned into torque on the
child in the sense of our angle.
"""

from math import degrees, exp, isnan, pi, radians

import numpy as np
import pytest

from benchmarks.leg_curves import fit, rms_errors, weighted_rms
from springs import Cubic
from springs.elastic import valid_range
from springs.published.reference import SampleKind
from springs.published.tables import (
    PublishedError,
    coupled_law,
    curve,
    curves_of_motion,
    publication,
    publications,
    rhythm,
)


def cubic(c0, c1, c2, c3, a):
    return c0 + c1 * a + c2 * a**2 + c3 * a**3


def step(x):
    return 10.0 * x**3 - 15.0 * x**4 + 6.0 * x**5


D = pi / 180.0

# Key, our angle [deg], torque on the child in the sense of our angle [N m]. A cubic with a dead
# zone is worked at an angle beyond it, less its value at the edge.
WAIST_X = (-0.427, 19.6, 0.676, -86.0)
WAIST_Y = (49.6, -153.0, -120.0, 241.0)
WAIST_Z = (-4.65, 136.0, 2.89, -92.6)
SHOULDER_X = (0.916317, 8.6218689, -14.15546098, 5.26654657)
SHOULDER_Y = (-2.206618, 30.548849, -50.880216, 29.906461)
SHOULDER_Z = (1.649642, -8.423282, -18.521593, -9.404547)
HIP_X = (-0.131, 136.0, 8.42, -218.0)
HIP_Y = (33.180672, -144.6, 188.2, -82.76)
HIP_Z = (2.91, 38.3, -13.4, -106.0)
ELBOW = (1.014, 29.224, -6.13885, 214.423)
KNEE = (-15.5, 84.5, -124.0, 49.2)

OTANI = [
    ("waist_x", 45.0, cubic(*WAIST_X, 45 * D)),
    ("waist_y", 75.0, -cubic(*WAIST_Y, 75 * D)),
    ("waist_z", 80.0, cubic(*WAIST_Z, 80 * D)),
    ("shoulder_x", 150.0, -cubic(*SHOULDER_X, 150 * D)),
    ("shoulder_y", 90.0, -cubic(*SHOULDER_Y, 90 * D)),
    ("shoulder_z", 45.0, cubic(*SHOULDER_Z, 45 * D)),
    ("hip_x", 60.0, cubic(*HIP_X, 60 * D)),
    ("hip_y", 80.0, cubic(*HIP_Y, 80 * D)),
    ("hip_z", 45.0, cubic(*HIP_Z, 45 * D)),
    ("elbow", -10.0, cubic(*ELBOW, 0.0) - cubic(*ELBOW, -10 * D)),
    ("knee", 105.0, cubic(*KNEE, 1.553) - cubic(*KNEE, 105 * D)),
]
DAVY_AUDU = [
    ("hip", 0.0, 2.6 * exp(5.8 * 0.1745) - 8.7 * exp(-1.3 * 1.92)),
    ("hip_other_sign", 0.0, 2.6 * exp(-5.8 * 0.1745) - 8.7 * exp(-1.3 * 1.92)),
    # Flexed 105 deg is extended by -105 deg, and the moment of extension is turned back.
    (
        "knee",
        105.0,
        -(3.1 * exp(-5.9 * (-105 * D + 1.92)) - 10.5 * exp(-11.8 * (-0.1 + 105 * D))),
    ),
    (
        "ankle",
        10.0,
        2.0 * exp(-5.0 * (10 * D + 0.5236)) - 9.0 * exp(-5.0 * (0.3491 - 10 * D)),
    ),
]
ANDERSON_1999 = [
    (
        "hip_flexion",
        -30.0,
        1.51 * exp(-21.88 * (-30 * D + 0.47)) - 2.44 * exp(5.05 * (-30 * D - 1.81)),
    ),
    (
        "hip_flexion_wider",
        -40.0,
        1.51 * exp(-21.88 * (-40 * D + 0.6981)) - 2.44 * exp(5.05 * (-40 * D - 1.81)),
    ),
    # Abducted 60 deg is adducted by -60 deg.
    (
        "hip_adduction",
        60.0,
        -(0.03 * exp(-14.94 * (-60 * D + 0.5)) - 0.03 * exp(14.94 * (-60 * D - 0.5))),
    ),
    (
        "hip_rotation",
        60.0,
        -0.03 * exp(14.94 * (60 * D - 0.92)) + 0.03 * exp(-14.94 * (60 * D + 0.92)),
    ),
    (
        "knee",
        140.0,
        -(-6.09 * exp(33.94 * (-140 * D - 0.13)) + 11.03 * exp(-11.33 * (-140 * D + 2.4))),
    ),
    ("ankle", 32.0, -2.03 * exp(38.11 * (32 * D - 0.52)) + 0.18 * exp(-12.12 * (32 * D + 0.74))),
    (
        "subtalar",
        35.0,
        -60.21 * exp(16.32 * (35 * D - 0.65)) + 60.21 * exp(-16.32 * (35 * D + 0.65)),
    ),
    # Flexed 35 deg is extended by -35 deg.
    (
        "lumbar_extension",
        35.0,
        -(-0.35 * exp(30.72 * (-35 * D - 0.17)) + 0.25 * exp(-20.36 * (-35 * D + 0.5236))),
    ),
    (
        "lumbar_bending",
        30.0,
        -0.25 * exp(20.36 * (30 * D - 0.3491)) + 0.25 * exp(-20.36 * (30 * D + 0.3491)),
    ),
    (
        "lumbar_rotation",
        30.0,
        -0.25 * exp(20.36 * (30 * D - 0.3491)) + 0.25 * exp(-20.36 * (30 * D + 0.3491)),
    ),
]
# The printed moments are those of extension; ours are those of flexion.
ANDERSON_2007 = [
    ("hip_male_18_25", 20.0, 1.210 * exp(-6.351 * 20 * D) - 0.476 * exp(5.910 * 20 * D)),
    ("hip_female_18_25", 20.0, 1.753 * exp(-6.358 * 20 * D) - 0.239 * exp(3.872 * 20 * D)),
    ("hip_male_55_65", 20.0, 2.160 * exp(-8.073 * 20 * D) - 0.108 * exp(4.593 * 20 * D)),
    ("hip_female_55_65", 20.0, 1.361 * exp(-7.128 * 20 * D) - 0.013 * exp(6.479 * 20 * D)),
    ("hip_male_over_65", 20.0, 2.671 * exp(-7.850 * 20 * D) - 0.092 * exp(5.192 * 20 * D)),
    ("hip_female_over_65", 20.0, 0.758 * exp(-7.545 * 20 * D) - 0.018 * exp(6.061 * 20 * D)),
    ("knee_male_18_25", 5.0, 6.250 * exp(-4.521 * 5 * D)),
    ("knee_female_18_25", 5.0, 8.033 * exp(-5.250 * 5 * D)),
    ("knee_male_55_65", 5.0, 12.83 * exp(-5.127 * 5 * D)),
    ("knee_female_55_65", 5.0, 6.576 * exp(-4.466 * 5 * D)),
    ("knee_male_over_65", 5.0, 10.519 * exp(-5.662 * 5 * D)),
    ("knee_female_over_65", 5.0, 8.8 * exp(-6.763 * 5 * D)),
    ("ankle_male_18_25", 15.0, 0.0005781 * exp(-5.819 * 15 * D) - 0.967 * exp(6.090 * 15 * D)),
    ("ankle_female_18_25", 15.0, 0.005218 * exp(-4.875 * 15 * D) - 0.470 * exp(6.425 * 15 * D)),
]
VAN_ARKEL = [
    (
        "hip_rotation",
        35.0,
        -1.799123 * exp(24.428054 * (35 * D - 0.569022))
        + 1.777588 * exp(-24.428057 * (35 * D + 0.568529)),
    ),
]
SAUL = [
    ("elbow_flexion", 0.0, 100.0 * step(14.0 / 139.5813) * 14.0),
    ("elbow_flexion", 130.0, -0.3037 * step(45.0 / 139.5813) * 45.0),
    ("shoulder_elv", 180.0, -100.0 * step(30.0 / 542.8423) * 30.0),
    ("shoulder_elv", 0.0, 100.0 * step(30.0 / 542.8423) * 30.0),
    ("elv_angle", -90.0, 100.0 * step(30.0 / 545.4471) * 30.0),
    ("elv_angle", 130.0, -100.0 * step(30.0 / 545.4471) * 30.0),
    ("shoulder_rot", -90.0, 100.0 * step(30.0 / 485.4660) * 30.0),
    ("shoulder_rot", 15.0, -100.0 * step(25.0 / 485.4660) * 25.0),
    ("pro_sup", 90.0, -50.0 * step(30.0 / 430.1186) * 30.0),
    ("pro_sup", -90.0, 50.0 * step(30.0 / 430.1186) * 30.0),
]
# Thirty degrees over six segments are five a segment.
SCHMIDT = [
    ("flexion", 30.0, -1.8 * 5.0),
    ("extension", -30.0, 2.6 * 5.0),
    ("lateral_bend", 30.0, -2.3 * 5.0),
    ("axial_rotation", 30.0, -8.4 * 5.0),
]
HAN = [
    ("flexion", 30.0, -0.002 * 125.0 + 0.0141 * 25.0 - 0.4726 * 5.0),
    ("lateral_bend", 30.0, -0.0087 * 25.0 - 0.6989 * 5.0),
    ("axial_rotation", 30.0, -0.0061 * 125.0 - 1.0191 * 5.0),
]
# Stiffnesses of the four quarters of 28 deg, to the left.
WATT = [
    ("lateral_bend", 7.0, -1.7),
    ("lateral_bend", -28.0, 53.5),
    ("flexion", 69.6, -26.67),
]
ENGIN_CHEN = [
    ("hyperextension", -10.0, 7.067),
]
ZELLE = [
    ("thigh_calf", 150.0, -2.63),
]
WIEGNER_WATTS = [
    ("softest", 50.0, 0.40 * (1.8675 - 50 * D)),
    ("stiffest", 50.0, 1.8 * (1.8675 - 50 * D)),
]
FORMICA = [
    ("flexion", 30.0, -1.28 * 30 * D),
    ("radial_deviation", -30.0, 1.74 * 30 * D),
]
DELP = [
    ("wrist_flexion", 90.0, -0.5),
    ("wrist_flexion", -90.0, 1.2),
]
SILDER = [
    ("hip_knee_15", 60.0, -7.515),
    ("hip_knee_60", -15.0, 35.031),
    ("hip_knee_90", 0.0, 15.666),
    ("hip_knee_110", 80.0, -5.969),
    ("knee_hip_0_ankle_-15", 120.0, -17.062),
    ("knee_hip_0_ankle_20", 0.0, 20.884),
    ("knee_hip_45_ankle_0", 60.0, -0.002),
    ("knee_hip_-15_ankle_20", 90.0, -11.947),
    ("ankle_knee_0", 20.0, -39.868),
    ("ankle_knee_15", 0.0, -3.593),
    ("ankle_knee_60", -30.0, -0.368),
    ("ankle_knee_110", 20.0, -8.328),
]
CURVES = {
    "otani_1989": OTANI,
    "davy_audu_1987": DAVY_AUDU,
    "anderson_1999": ANDERSON_1999,
    "anderson_madigan_nussbaum_2007": ANDERSON_2007,
    "van_arkel_2015": VAN_ARKEL,
    "saul_2015": SAUL,
    "schmidt_1998": SCHMIDT,
    "han_2010": HAN,
    "silder_2007": SILDER,
    "watt_2022": WATT,
    "engin_chen_1987": ENGIN_CHEN,
    "zelle_2009": ZELLE,
    "wiegner_watts_1986": WIEGNER_WATTS,
    "formica_2012": FORMICA,
    "delp_1996": DELP,
}
ROWS = [(f"{source}/{name}", *rest) for source, rows in CURVES.items() for name, *rest in rows]


@pytest.mark.parametrize(("key", "angle", "torque"), ROWS)
def test_a_curve_is_as_printed(key, angle, torque):
    # Roots that bound a dead zone leave a rest of the size of rounding.
    assert curve(key).law.torque(radians(angle)) == pytest.approx(torque, rel=1e-7, abs=1e-9)


def test_no_curve_is_left_out():
    shipped = {f"{name}/{row}" for name in publications() for row in publication(name).curves}
    assert {key for key, *_ in ROWS} == shipped


@pytest.mark.parametrize(
    ("key", "angle", "torque"),
    [
        # Numbers told elsewhere, so that a slip in both the table and the arithmetic would show.
        ("otani_1989/hip_y", 80.0, -27.1),
        ("otani_1989/shoulder_y", 90.0, -36.1),
        ("otani_1989/elbow", 130.0, -1454.0),
        ("davy_audu_1987/hip", -15.0, 32.1),
        ("davy_audu_1987/knee", -5.0, 95.7),
        ("anderson_1999/lumbar_bending", 30.0, -8.7),
        ("anderson_madigan_nussbaum_2007/hip_male_18_25", 60.0, -232.0),
        ("anderson_madigan_nussbaum_2007/hip_male_55_65", -15.0, 17.8),
        ("saul_2015/elbow_flexion", -20.0, 329.0),
        ("saul_2015/elbow_flexion", 110.0, -0.3),
        ("saul_2015/shoulder_rot", 30.0, -19.7),
        ("van_arkel_2015/hip_rotation", 35.0, -5.0),
        ("van_arkel_2015/hip_rotation", 40.0, -42.0),
    ],
)
def test_curves_have_the_values_that_are_told_of_them(key, angle, torque):
    assert curve(key).law.torque(radians(angle)) == pytest.approx(torque, rel=0.03, abs=0.05)


def test_every_law_knows_the_range_of_its_row():
    for key in {key for key, *_ in ROWS}:
        row = curve(key)
        if row.valid_range is not None and not isinstance(row.law, Cubic) and "schmidt" not in key:
            assert valid_range(row.law) == pytest.approx(row.valid_range), key
        assert row.damping is None or row.damping > 0.0, key
        assert row.motion, key
        assert row.reference.text == publication(key.partition("/")[0]).reference.text
        assert row.sample.kind is not SampleKind.UNKNOWN, key


RIENER = coupled_law("riener_edrich_1999/leg").law
SILDER_LEG = coupled_law("silder_2007/leg").law


def riener_printed(h, k, a):
    """Moments in the printed senses: ankle plantarflexion +; angles in deg."""
    hip = exp(1.4655 - 0.0034 * k - 0.0750 * h) - exp(1.3403 - 0.0226 * k + 0.0305 * h) + 8.072
    knee = exp(1.800 - 0.0460 * a - 0.0352 * k + 0.0217 * h) - 4.820 + exp(2.220 - 0.150 * k)
    knee -= exp(-3.971 - 0.0004 * a + 0.0495 * k - 0.0128 * h)
    ankle = exp(2.1016 - 0.0843 * a - 0.0176 * k) - exp(-7.9763 + 0.1949 * a + 0.0008 * k) - 1.792
    return hip, knee, ankle


@pytest.mark.parametrize("angles", [(0, 0, 0), (90, 15, 10), (-15, 110, -20), (40, 60, 5)])
def test_riener_and_edrich_are_as_printed(angles):
    h, k, dorsiflexion = angles
    hip, knee, plantarflexing = riener_printed(h, k, -dorsiflexion)
    torques = RIENER.torques([radians(angle) for angle in angles])
    assert torques == pytest.approx((hip, knee, -plantarflexing), rel=1e-12)


def silder_printed(h, k, a):
    """Moments with angles in rad."""
    rectus = exp(-3.1 * (h - 1.9 / 3.1 * k - 24.4 * D))
    hamstrings = exp(5.1 * (h - 3.9 / 5.1 * k - 30.8 * D))
    gastrocnemius = exp(-4.5 * (k - 4.7 / 4.5 * a - 26.0 * D))
    hip = rectus - hamstrings + exp(-5.1 * (h - 19.5 * D)) - exp(2.0 * (h - 27.3 * D))
    knee = -1.9 / 3.1 * rectus + 3.9 / 5.1 * hamstrings + gastrocnemius
    knee += exp(-5.8 * (k - 12.8 * D)) - exp(3.5 * (k - 101.9 * D))
    ankle = -4.7 / 4.5 * gastrocnemius - exp(4.9 * (a + 3.4 * D))
    return hip, knee, ankle


@pytest.mark.parametrize("angles", [(0, 0, 0), (60, 15, 10), (-10, 90, -20), (40, 60, 5)])
def test_silder_s_equations_are_as_printed(angles):
    turned = [radians(angle) for angle in angles]
    assert SILDER_LEG.torques(turned) == pytest.approx(silder_printed(*turned), rel=1e-12)


def test_silder_s_curves_are_nearly_the_gradient_of_one_energy():
    """A fit hardly comes nearer, and the law is a gradient beyond the curves, too."""
    row = coupled_law("silder_2007/leg_curves")
    assert rms_errors(row.law) == pytest.approx([0.353, 0.302, 0.218], abs=0.001)
    assert weighted_rms(fit(row.law)) == pytest.approx(weighted_rms(row.law), rel=0.002)
    assert row.law.is_conservative
    assert row.range_is_measured
    corner = np.radians([80.0, 0.0, 20.0])
    hamstrings = row.law.terms[6]
    assert hamstrings.end == pytest.approx(-4.905 + 5.55 * radians(80.0))
    torques = [row.law.torques(corner + np.radians([k, 0.0, 0.0]))[0] for k in (20.0, 40.0, 60.0)]
    assert np.diff(torques, 2) == pytest.approx(0.0, abs=0.1)


def test_equation_and_digitised_curve_of_silder_agree_in_the_normal_range():
    row = curve("silder_2007/hip_knee_15")
    hip, torque = np.array(row.law.points).T
    equation = SILDER_LEG.torques((hip, radians(15.0), 0.0))[0]
    assert np.sqrt(np.mean((equation - torque) ** 2)) == pytest.approx(2.975, abs=0.001)
    assert SILDER_LEG.torques((radians(-15.0), radians(110.0), 0.0))[0] == pytest.approx(345, abs=1)


def test_the_equations_of_the_leg_tell_where_they_hold():
    assert [degrees(end) for pair in SILDER_LEG.valid_ranges for end in pair] == pytest.approx(
        [-15.0, 100.0, 0.0, 135.0, -20.0, 20.0]
    )
    assert coupled_law("silder_2007/leg").range_is_measured
    assert not coupled_law("riener_edrich_1999/leg").range_is_measured


RHYTHMS = [
    # Arm elevation, plane of elevation, angle of the bone [deg].
    ("otani_1989/clavicle_frontal", 90, 0, 0.2514 * 90 + 91.076 - 90),
    ("otani_1989/clavicle_frontal", 150, 0, -0.035 * 150 + 128.7 - 90),
    ("otani_1989/clavicle_sagittal", 90, 90, 0.21066 * 90 + 92.348 - 90),
    ("otani_1989/clavicle_sagittal", 150, 90, 120 - 90),
    (
        "de_groot_brand_2001/clavicle_protraction",
        90,
        30,
        -4.983 + 0.120 * 30 - 0.242 * 90 + 0.851 * -28.573,
    ),
    (
        "de_groot_brand_2001/clavicle_elevation",
        90,
        30,
        3.917 - 0.046 * 30 + 0.123 * 90 + 0.493 * 11.680,
    ),
    (
        "de_groot_brand_2001/scapula_protraction",
        90,
        30,
        -1.203 + 0.140 * 30 - 0.049 * 90 + 0.901 * 32.047,
    ),
    (
        "de_groot_brand_2001/scapula_upward_rotation",
        90,
        30,
        3.095 - 0.079 * 30 + 0.396 * 90 + 0.414 * 10.669,
    ),
    ("de_groot_brand_2001/scapula_tilt", 90, 30, 0.659 - 0.028 * 30 + 0.184 * 90 + 0.886 * -10.320),
    ("spartacus/ludewig_2009_frontal", 90, 0, 18.1),
    ("spartacus/ludewig_2009_sagittal", 90, 90, 13.5),
    ("spartacus/fung_2001_frontal", 150, 0, 21.5),
    ("spartacus/fung_2001_sagittal", 150, 90, 21.4),
    ("spartacus/oki_frontal", 120, 0, 28.8),
    ("spartacus/oki_sagittal", 120, 90, 26.8),
    ("spartacus/sahara_2007_frontal", 0, 0, 6.3),
    ("spartacus/karduna_sagittal", 60, 90, 6.4),
]


@pytest.mark.parametrize(("key", "elevation", "plane", "angle"), RHYTHMS)
def test_a_rhythm_is_as_printed(key, elevation, plane, angle):
    found = rhythm(key).law.angle(radians(elevation), radians(plane))
    assert degrees(found) == pytest.approx(angle, abs=1e-9)


def test_no_rhythm_is_left_out():
    shipped = {f"{name}/{row}" for name in publications() for row in publication(name).rhythms}
    assert {key for key, *_ in RHYTHMS} == shipped


def test_readings_end_where_they_were_read():
    assert isnan(rhythm("spartacus/oki_frontal").law.angle(radians(130.0)))


RANGE_SOURCES = (
    *("aaos", "boone_azen_1979", "ama", "macedo_magee_2009", "soucie_2011", "kouyoumdjian_2012"),
    *("van_arkel_2015", "sforza_2002", "tommasi_2009", "alazzawi_2017"),
    "family_practice_notebook",
)
LIMITS = """
shoulder flexion            180   167   180   188 168.8     -     -     -     -     -     -
shoulder extension           60    62    50    70     -     -     -     -     -     -     -
shoulder abduction          180   184   170   188     -     -     -     -     -     -     -
shoulder medial rotation     70    69    80    94     -     -     -     -     -     -     -
shoulder lateral rotation    90   104    60   108     -     -     -     -     -     -     -
elbow flexion               150   143   140   149 144.6     -     -     -     -     -     -
elbow hyperextension          0     1     0     2   0.8     -     -     -     -     -     -
forearm pronation            80    76    80    92  76.9     -     -     -     -     -     -
forearm supination           80    82    80    96  85.0     -     -     -     -     -     -
hip abduction                45     -     -     -     -     -    30     -     -     -     -
hip adduction                30     -     -     -     -     -    40     -     -     -     -
hip flexion                   -     -     -     - 130.4     -     -     -     -     -     -
hip extension                 -     -     -     -  17.4     -    12     -     -     -     -
hip medial rotation           -     -     -     -     -  35.2     -     -     -     -     -
hip lateral rotation          -     -     -     -     -  41.8     -     -     -     -     -
knee flexion                  -     -     -     - 137.7     -     -     -     -     -     -
knee hyperextension           -     -     -     -   1.0     -     -     -     -     -     -
waist flexion                80     -     -     -     -     -     -     -     -     -     -
waist extension              25     -     -     -     -     -     -     -     -     -     -
waist lateral bend           35     -     -     -     -     -     -     -     -     -     -
waist twist                  45     -     -     -     -     -     -     -     -     -     -
wrist flexion                80    76    60    93     -     -     -     -     -     -     -
wrist extension              70    75    60    86     -     -     -     -     -     -     -
wrist radial deviation       20    22    20    18     -     -     -     -     -     -     -
wrist ulnar deviation        30    36    30    41     -     -     -     -     -     -     -
neck flexion                 45     -     -     -     -     -     -  65.5    64     -     -
neck extension               45     -     -     -     -     -     -  65.5    64     -     -
neck lateral bend            45     -     -     -     -     -     -  38.5  50.5     -     -
neck twist                   60     -     -     -     -     -     -  77.5  75.5     -     -
ankle dorsiflexion            -     -     -     -     -     -     -     -     -    20     -
ankle plantarflexion          -     -     -     -     -     -     -     -     -    50     -
ankle inversion               -     -     -     -     -     -     -     -     -    35     -
ankle eversion                -     -     -     -     -     -     -     -     -    15     -
shoulder adduction            -     -     -     -     -     -     -     -     -     -    30
"""
"""Ends of ranges of motion [deg], a column for each of `RANGE_SOURCES`."""


def limits_of(source: str) -> dict[str, float]:
    """Limits [deg] by motion, from the column of a source."""
    column = RANGE_SOURCES.index(source) - len(RANGE_SOURCES)
    cells = {line[:25].strip(): line.split()[column] for line in LIMITS.strip().splitlines()}
    return {motion: float(cell) for motion, cell in cells.items() if cell != "-"}


@pytest.mark.parametrize("name", RANGE_SOURCES)
def test_ranges_of_motion_are_as_printed(name):
    rows = publication(name).ranges
    found = {row.motion: round(degrees(row.limit), 6) for row in rows}
    assert found == limits_of(name)
    assert len(rows) == len(found)


def test_ranges_of_the_lumbar_spine_fall_with_age():
    rows = publication("troke_2005").ranges
    found = {(row.motion, row.age): round(degrees(row.limit), 6) for row in rows}
    assert found == {
        ("lumbar flexion", 16): 73,
        ("lumbar flexion", 90): 40,
        ("lumbar extension", 16): 29,
        ("lumbar extension", 90): 6,
        ("lumbar lateral bend", 16): 28,
        ("lumbar lateral bend", 90): 14,
        ("lumbar twist", None): 7,
    }


def test_no_range_of_motion_is_left_out():
    shipped = {name for name in publications() if publication(name).ranges}
    assert shipped == {*RANGE_SOURCES, "troke_2005", "spine_shares"}


def range_limits(name: str, age: float | None = None) -> dict[str, float]:
    """Limits of a publication [deg] by motion."""
    rows = publication(name).ranges
    return {row.motion: degrees(row.limit) for row in rows if row.age in (age, None)}


def test_the_lumbar_spine_has_its_measured_range_and_the_thorax_the_rest():
    whole, shares = range_limits("aaos"), range_limits("spine_shares")
    young, old = range_limits("troke_2005", 16), range_limits("troke_2005", 90)
    lumbar = {motion: np.interp(30, (16, 90), (young[motion], old[motion])) for motion in young}
    for motion in ("flexion", "extension", "lateral bend", "twist"):
        both = shares[f"lumbar {motion}"] + shares[f"thorax {motion}"]
        assert both == pytest.approx(whole[f"waist {motion}"], abs=1e-9)
    for motion in ("lumbar lateral bend", "lumbar twist"):
        assert shares[motion] == pytest.approx(lumbar[motion], abs=0.051)
    arc = shares["lumbar flexion"] + shares["lumbar extension"]
    assert arc == pytest.approx(lumbar["lumbar flexion"] + lumbar["lumbar extension"], abs=0.051)
    whole_arc = whole["waist flexion"] + whole["waist extension"]
    share = whole["waist flexion"] / whole_arc
    assert shares["lumbar flexion"] / arc == pytest.approx(share, rel=1e-3)
    assert {row.sample.kind for row in publication("spine_shares").ranges} == {SampleKind.ESTIMATE}


def test_ranges_of_another_source_than_their_table_say_so():
    (hip,) = (row for row in publication("aaos").ranges if row.motion == "hip abduction")
    (elbow,) = (row for row in publication("aaos").ranges if row.motion == "elbow flexion")
    assert "table A.1" in elbow.reference.text
    assert "table A.1" not in hip.reference.text
    assert hip.sample.kind is SampleKind.NORM


def test_curves_end_where_they_were_measured():
    ligaments = curve("van_arkel_2015/hip_rotation")
    assert ligaments.range_is_measured
    assert [degrees(end) for end in ligaments.valid_range] == pytest.approx([-35.0, 35.0])
    for end in ligaments.valid_range:
        assert abs(ligaments.law.torque(end)) == pytest.approx(5.0, abs=0.05)
    twist = curve("schmidt_1998/axial_rotation")
    assert [degrees(end) for end in twist.valid_range] == pytest.approx([-7.0, 7.0])
    assert not twist.range_is_measured


def test_lumbar_bend_integrates_the_stiffness_of_the_quarters():
    means = (
        (0.23 + 0.25 + 0.26) / 3.0,
        (0.61 + 0.63 + 0.64) / 3.0,
        (1.71 + 1.74 + 1.63) / 3.0,
        (5.19 + 5.25 + 4.79) / 3.0,
    )
    law = curve("watt_2022/lateral_bend").law
    torques = [-law.torque(radians(angle)) for angle in (7.0, 14.0, 21.0, 28.0)]
    assert torques == pytest.approx(7.0 * np.cumsum(means), abs=0.06)


def test_lumbar_flexion_integrates_the_stiffness_of_three_zones():
    law, third = curve("watt_2022/flexion").law, 69.6 / 3.0
    at_ends = [-law.torque(radians(third * k)) for k in (1, 2, 3)]
    assert at_ends == pytest.approx(100.0 / 3.0 * np.cumsum((0.0, 0.1, 0.7)), abs=0.01)
    inside = [-law.torque(radians(third * (k + 0.5))) for k in (1, 2)]
    assert inside == pytest.approx([100.0 / 6.0 * 0.1, 100.0 / 3.0 * (0.1 + 0.35)], abs=0.01)


def test_the_points_of_engin_and_chen_are_their_cubic_of_extension():
    law = curve("engin_chen_1987/hyperextension").law
    for angle in (0.0, 5.0, 10.0, 15.0):
        assert law.torque(radians(-angle)) == pytest.approx(cubic(*ELBOW, angle * D), abs=1e-3)


def test_the_contact_of_thigh_and_calf_is_the_fit_of_its_source():
    law = curve("zelle_2009/thigh_calf").law
    angles = np.arange(90.0, 171.0, 1.0)
    fitted = -25.385677 * (np.tanh(4.066036 * angles * D - 12.097768) + 0.999998)
    assert law.torque(np.radians(angles)) == pytest.approx(fitted, rel=0.01, abs=0.02)
    assert law.torque(0.0) == 0.0


def test_silder_s_points_are_one_for_each_degree():
    rows = publication("silder_2007").curves.values()
    counts = [len(row.printed.points) for row in rows]
    assert counts == [96] * 4 + [121] * 4 + [51] * 4
    assert all(np.allclose(np.diff(np.array(row.printed.points)[:, 0]), 1.0) for row in rows)
    assert {row.sample.subjects for row in rows} == {20}


def test_the_band_of_a_curve_is_its_published_scatter():
    angles = np.radians([0.0, 20.0])
    knee = curve("anderson_madigan_nussbaum_2007/knee_male_18_25")
    below, above = knee.torque_band(angles)
    # At 0 deg the rate has no say: 6.25 +- 2.617 N m.
    assert (below[0], above[0]) == pytest.approx((6.25 - 2.617, 6.25 + 2.617))
    steep, flat = (6.25 * exp(-(4.521 + d) * 20 * D) for d in (0.553, -0.553))
    middle = 6.25 * exp(-4.521 * 20 * D)
    own = 2.617 * exp(-4.521 * 20 * D)
    assert below[1] == pytest.approx(middle - np.hypot(own, middle - steep))
    assert above[1] == pytest.approx(middle + np.hypot(own, flat - middle))
    silder = curve("silder_2007/hip_knee_15")
    low, high = silder.torque_band(angles)
    assert high - low == pytest.approx([5.0, 5.0])
    assert curve("saul_2015/elbow_flexion").torque_band(angles) is None


def test_a_row_may_be_less_sure_than_its_publication():
    surenesses = {
        name: row.reference.sureness.value
        for name, row in publication("davy_audu_1987").curves.items()
    }
    assert surenesses == {"hip": "D", "hip_other_sign": "D", "knee": "D", "ankle": "C1"}
    assert curve("anderson_1999/knee").reference.place == "table G.2, eq. 4.4"


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (
            lambda: publication("saul_2051"),
            "no published table `saul_2051`; did you mean `saul_2015`?",
        ),
        (lambda: curve("saul_2015/elbow_flexon"), "did you mean `elbow_flexion`?"),
        (
            lambda: curve("saul_2015/zzz"),
            "`saul_2015` has no curve `zzz`; there are elbow_flexion,",
        ),
        (lambda: coupled_law("saul_2015/leg"), "`saul_2015` has no coupled law `leg`$"),
        (lambda: rhythm("spartacus/oki"), "`spartacus` has no rhythm `oki`"),
    ],
)
def test_what_there_is_not_is_said(ask, message):
    with pytest.raises(PublishedError, match=message):
        ask()


def test_curves_of_a_motion_are_one_of_each_publication_and_measurements_come_first():
    found = curves_of_motion("left_knee", "flexion")
    keys = [key for key, _ in found]
    assert keys[0].startswith("silder_2007/")
    assert len({key.partition("/")[0] for key in keys}) == len(keys)
    assert all(curve(key) is row for key, row in found)
    obstacles = [bool(row.obstacle) for _, row in found]
    assert obstacles == sorted(obstacles)
    assert {row.motion for _, row in found} == {"knee flexion"}
    assert curves_of_motion("hinge", "flexion") == []

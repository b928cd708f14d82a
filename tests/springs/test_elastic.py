import numpy as np
import pytest

from springs import Cubic, Linear, Stop, total_energy, total_torque

LAWS = (Linear(10.0, 0.1), Cubic((1.0, 2.0, 3.0, 4.0)), Stop(-0.2, 0.2))


@pytest.mark.parametrize("angle", [-0.5, 0.0, 0.15, 0.6])
def test_laws_of_one_axis_add(angle):
    assert total_torque(LAWS, angle) == sum(law.torque(angle) for law in LAWS)
    assert total_energy(LAWS, angle) == sum(law.energy(angle) for law in LAWS)


def test_without_laws_there_is_no_torque_for_any_angle():
    angles = np.array([-1.0, 0.0, 2.0])
    assert total_torque((), angles).tolist() == [0.0, 0.0, 0.0]
    assert total_energy((), angles).tolist() == [0.0, 0.0, 0.0]
    assert total_torque((), 0.3) == total_energy((), 0.3) == 0.0

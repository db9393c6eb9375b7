# SPDX-License-Identifier: BSD-3-Clause
import math
from dataclasses import replace

import numpy as np
import pytest
from attrs import evolve

from hive_common.errors import MapError, ParameterError
from hive_common.pose import Pose, between, blend, compose, inverse
from hive_common.turned_map import TurnedMap
from hive_navigation.localization.amcl_settings import AmclSettings
from hive_navigation.localization.likelihood_field import BeamChooser, LikelihoodField
from hive_navigation.localization.localizer import Localizer
from hive_navigation.localization.odometry_history import OdometryHistory
from hive_navigation.localization.odometry_model import spread
from hive_navigation.localization.particle_filter import START_ANYWHERE, ParticleFilter
from robot_description.models import Laser
from robot_description.scan import Scan

SETTINGS = AmclSettings(max_particles=3000)
LASER = Laser(360, 0.1, 6.0, 2 * math.pi, 10.0, (0.0, 0.0, 0.0))
NO_NOISE = replace(SETTINGS, **{f"odom_alpha{i}": 0.0 for i in range(1, 6)})
SIDE, STEP = 6.0, 0.05


def room():
    """Return the cells of a room of 6 m x 6 m with walls, and a pillar off its middle."""
    cells = np.zeros((120, 120), dtype=np.int8)
    cells[:2] = cells[-2:] = 100
    cells[:, :2] = cells[:, -2:] = 100
    cells[80:90, 30:40] = 100
    return cells


CELLS = room()


def scan(pose, cells=CELLS):
    """Return what a perfect laser measures in the room, by walking along its beams."""
    angles = (np.arange(LASER.beams) / LASER.beams - 0.5) * LASER.field_of_view + pose.yaw
    steps = np.arange(0.0, LASER.range_max, 0.01)
    x = ((pose.x + np.outer(np.cos(angles), steps)) / STEP).astype(int).clip(0, 119)
    y = ((pose.y + np.outer(np.sin(angles), steps)) / STEP).astype(int).clip(0, 119)
    hit = cells[y, x] == 100
    return Scan.of(LASER, np.where(hit.any(axis=1), steps[hit.argmax(axis=1)], np.inf))


def filter_in_the_room(settings=SETTINGS, seed=1):
    field = LikelihoodField(CELLS, STEP, (0.0, 0.0), settings)
    return ParticleFilter(field, settings, np.random.default_rng(seed))


def localizer_in_the_room(settings=SETTINGS, seed=1):
    particles = filter_in_the_room(settings, seed)
    chooser = BeamChooser(LASER, settings.laser_max_beams)
    return particles, Localizer(particles, chooser, settings)


def drive(localizer, start, moves, time=0.0):
    """Show a localizer a drive whose odometry is perfect; return the last true pose."""
    odometry, truth = Pose(0.0, 0.0, 0.0), start
    localizer.see(time, odometry, scan(truth))
    for count in range(1, moves + 1):
        move = Pose(0.12, 0.0, 0.15)
        odometry, truth = compose(odometry, move), compose(truth, move)
        localizer.see(time + 0.25 * count, odometry, scan(truth))
    return truth


def test_a_scan_is_likeliest_where_it_was_taken():
    field = LikelihoodField(CELLS, STEP, (0.0, 0.0), SETTINGS)
    here = Pose(3.0, 2.0, 0.5)
    others = np.array([here, (3.5, 2.0, 0.5), (3.0, 2.5, 0.5), (3.0, 2.0, 0.9), (4.6, 4.0, 2.0)])

    likely = field.log_likelihood(others, BeamChooser(LASER, 60).of(scan(here)))

    assert likely.argmax() == 0


@pytest.mark.parametrize("yaw", [0.4, math.pi / 2, -2.0])
def test_on_a_map_that_is_turned_a_scan_is_likeliest_where_it_was_taken(yaw):
    origin = Pose(-4.0, 7.0, yaw)
    chart = TurnedMap(CELLS, STEP, origin).upright()
    field = LikelihoodField(chart.cells, chart.resolution, chart.origin[:2], SETTINGS)
    here = Pose(3.0, 2.0, 0.5)
    others = [here, (3.5, 2.0, 0.5), (3.0, 2.5, 0.5), (3.0, 2.0, 0.9), (4.6, 4.0, 2.0)]
    there = np.array([compose(origin, Pose(*other)) for other in others])

    likely = field.log_likelihood(there, BeamChooser(LASER, 60).of(scan(here)))

    assert likely.argmax() == 0


def test_a_scan_that_hits_nothing_makes_places_beside_a_wall_unlikely():
    near_sighted = evolve(LASER, range_max=1.0)
    field = LikelihoodField(CELLS, STEP, (0.0, 0.0), SETTINGS)
    nothing = np.full(360, np.inf)

    beams = BeamChooser(near_sighted, 60).of(Scan.of(near_sighted, nothing))
    middle, wall = field.log_likelihood(np.array([(3.0, 2.0, 0.0), (0.4, 2.0, 0.0)]), beams)

    assert len(beams.ends) == 0
    assert middle > wall


def test_too_close_and_unknown_ranges_are_ignored():
    ranges = np.full(360, -np.inf)
    ranges[::2] = np.nan
    ranges[0] = 1.0

    beams = BeamChooser(LASER, 60).of(Scan.of(LASER, ranges))

    assert (len(beams.ends), len(beams.clear)) == (1, 0)


def test_a_rough_start_pose_soon_becomes_precise():
    particles, localizer = localizer_in_the_room()
    localizer.restart_at(Pose(3.2, 1.9, 0.1), np.diag([0.04, 0.04, 0.01]))

    truth = drive(localizer, Pose(3.0, 2.0, 0.0), moves=12)

    estimate = localizer.estimate
    assert math.dist(estimate.pose[:2], truth[:2]) < 0.06
    assert abs(math.remainder(estimate.pose.yaw - truth.yaw, math.tau)) < math.radians(2)
    assert estimate.share > 0.95
    assert len(particles.particles) < 600


def test_a_lost_robot_finds_its_pose():
    particles, localizer = localizer_in_the_room()
    localizer.restart_anywhere()
    assert len(particles.particles) == START_ANYWHERE * SETTINGS.max_particles

    truth = drive(localizer, Pose(4.0, 3.0, 1.0), moves=30)

    assert math.dist(localizer.estimate.pose[:2], truth[:2]) < 0.1
    assert len(particles.particles) < SETTINGS.max_particles / 4


def test_a_lost_robot_starts_with_more_particles_than_it_keeps():
    particles = filter_in_the_room()
    particles.start_anywhere()
    begun = len(particles.particles)

    particles.weigh(BeamChooser(LASER, 60).of(scan(Pose(2.0, 1.5, 0.3))))
    particles.resample()

    assert begun == START_ANYWHERE * SETTINGS.max_particles
    assert len(particles.particles) <= SETTINGS.max_particles


def test_on_a_map_without_a_free_cell_the_reason_is_told():
    field = LikelihoodField(np.full_like(CELLS, 100), STEP, (0.0, 0.0), SETTINGS)

    with pytest.raises(MapError, match="no cell of the map is free"):
        field.anywhere(10, np.random.default_rng(1))


def test_a_pose_gets_the_same_weight_alone_and_among_thousands():
    field = LikelihoodField(CELLS, STEP, (0.0, 0.0), SETTINGS)
    poses = field.anywhere(8001, np.random.default_rng(1))
    beams = BeamChooser(LASER, 60).of(scan(Pose(2.0, 1.5, 0.3)))

    together = field.log_likelihood(poses, beams)

    alone = [field.log_likelihood(poses[row : row + 1], beams)[0] for row in range(0, 8000, 999)]
    assert together[:8000:999] == pytest.approx(alone)


def test_the_same_seed_gives_the_same_run_to_the_last_bit():
    runs = []
    for _ in range(2):
        particles, localizer = localizer_in_the_room(seed=7)
        localizer.restart_anywhere()
        drive(localizer, Pose(3.0, 2.0, 0.0), moves=5)
        runs.append((particles.particles.tobytes(), localizer.estimate.pose))

    assert runs[0] == runs[1]


def test_with_recovery_a_robot_that_was_carried_away_finds_its_pose():
    settings = replace(SETTINGS, recovery_alpha_slow=0.05, recovery_alpha_fast=0.5)
    _, localizer = localizer_in_the_room(settings)
    localizer.restart_at(Pose(3.0, 2.0, 0.0), np.diag([0.01, 0.01, 0.01]))
    drive(localizer, Pose(3.0, 2.0, 0.0), moves=10)

    truth = drive(localizer, Pose(4.6, 4.4, 3.0), moves=40, time=100.0)

    assert math.dist(localizer.estimate.pose[:2], truth[:2]) < 0.2


def test_a_standing_robot_uses_one_scan_unless_asked_for_another():
    _, localizer = localizer_in_the_room()
    localizer.restart_at(Pose(3.0, 2.0, 0.0), np.diag([0.01, 0.01, 0.01]))
    here, taken = Pose(0.0, 0.0, 0.0), scan(Pose(3.0, 2.0, 0.0))

    assert localizer.see(0.0, here, taken)
    assert not localizer.see(1.0, here, taken)
    localizer.update_once()
    assert localizer.see(2.0, here, taken)


def test_the_update_rate_limits_how_many_scans_are_used():
    _, localizer = localizer_in_the_room(replace(SETTINGS, update_rate=5.0))
    localizer.restart_at(Pose(3.0, 2.0, 0.0), np.diag([0.01, 0.01, 0.01]))
    taken = scan(Pose(3.0, 2.0, 0.0))

    counted = [localizer.see(0.1 * i, Pose(0.5 * i, 0.0, 0.0), taken) for i in range(21)]

    assert sum(counted) == 11


def test_a_restarted_simulation_does_not_stop_the_localization():
    _, localizer = localizer_in_the_room()
    localizer.restart_at(Pose(3.0, 2.0, 0.0), np.diag([0.01, 0.01, 0.01]))
    taken = scan(Pose(3.0, 2.0, 0.0))
    localizer.see(100.0, Pose(0.0, 0.0, 0.0), taken)

    assert localizer.see(0.5, Pose(1.0, 0.0, 0.0), taken)


@pytest.mark.parametrize("kind", ["diff", "omni"])
def test_without_noise_particles_move_as_the_odometry_says(kind):
    before, after = Pose(1.0, 1.0, 0.5), Pose(1.3, 1.2, 0.9)
    settings = replace(NO_NOISE, odom_model_type=kind)

    moved = spread(np.array([before]), between(before, after), settings, np.random.default_rng(1))

    assert moved[0] == pytest.approx(after)


def test_driving_backwards_is_as_certain_as_driving_forwards():
    spreads = [
        spread(np.zeros((4000, 3)), Pose(x, 0.0, 0.0), SETTINGS, np.random.default_rng(1))
        for x in (0.5, -0.5)
    ]

    forwards, backwards = (np.std(moved[:, 2]) for moved in spreads)

    assert backwards == pytest.approx(forwards, rel=0.05)


def test_kld_sampling_takes_more_particles_for_a_wider_cloud():
    counts = []
    for deviation in (0.05, 0.5, 2.0):
        particles = filter_in_the_room(AmclSettings())
        covariance = np.diag([deviation**2, deviation**2, 0.01])
        particles.start_at(Pose(3.0, 3.0, 0.0), covariance)
        particles.resample()
        counts.append(len(particles.particles))

    assert counts[0] < counts[1] < counts[2]
    assert counts[0] >= SETTINGS.min_particles


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("min_particles", 0, "above 0"),
        ("laser_z_hit", 1.2, "from 0 to 1"),
        ("odom_alpha1", -0.1, "at least 0"),
        ("initial_pose_x", math.nan, "finite"),
        ("odom_model_type", "tank", "diff, omni"),
        ("max_particles", 10, "min_particles"),
    ],
)
def test_an_amcl_setting_that_is_not_allowed_is_named(name, value, allowed):
    with pytest.raises(ParameterError, match=allowed):
        AmclSettings(**{name: value})


def test_odometry_between_two_readings_is_interpolated():
    history = OdometryHistory()
    history.add(1.0, Pose(0.0, 0.0, 3.0))
    assert history.at(1.0) == Pose(0.0, 0.0, 3.0)
    assert history.at(1.5) is None
    history.add(2.0, Pose(1.0, 2.0, -3.0))

    between_both = history.at(1.5)

    assert between_both[:2] == pytest.approx((0.5, 1.0))
    assert abs(between_both.yaw) == pytest.approx(math.pi)
    assert history.at(0.5) is None


def test_odometry_from_before_a_restart_is_forgotten():
    history = OdometryHistory()
    history.add(50.0, Pose(9.0, 9.0, 0.0))
    history.add(0.1, Pose(0.0, 0.0, 0.0))

    assert history.at(50.0) is None


def test_inverse_and_blend_undo_and_halve_a_move():
    pose = Pose(1.0, -2.0, 2.5)

    assert compose(inverse(pose), pose) == pytest.approx((0.0, 0.0, 0.0))
    assert blend(Pose(0, 0, 0), pose, 0.5)[:2] == pytest.approx((0.5, -1.0))


def test_on_a_new_map_a_robot_goes_on_from_where_it_is_and_localizes_by_the_new_walls():
    moved = CELLS.copy()
    moved[80:90, 30:40] = 0
    moved[30:40, 20:30] = 100
    _, localizer = localizer_in_the_room()
    here = Pose(3.0, 2.0, 0.5)
    localizer.restart_at(here, 0.01 * np.eye(3))
    localizer.see(0.0, Pose(0.0, 0.0), scan(here))
    before = localizer.estimate.pose

    localizer.change_map(LikelihoodField(moved, STEP, (0.0, 0.0), SETTINGS))
    used = localizer.see(1.0, Pose(0.0, 0.0), scan(here, moved))
    for number in range(12):
        localizer.update_once()
        localizer.see(2.0 + number, Pose(0.0, 0.0), scan(here, moved))

    assert used
    assert before.distance_to(here) < 0.15
    assert localizer.estimate.pose.distance_to(here) < 0.1

"""What is measured: groups of tables, and the same on small grounds."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from benchmarks import memory, report
from benchmarks.detection import faults as detector_faults
from benchmarks.detection import map_advice, map_estimates, map_loop
from benchmarks.detection import odometry as detector_odometry
from benchmarks.detection import outliers as detector_outliers
from benchmarks.detection import proof as detector_proof
from benchmarks.detection import speed as detector_speed
from benchmarks.gnss import deep, differential, receiver
from benchmarks.navigation import (
    bubbles,
    few_satellites,
    inertial,
    long_drive,
    lying_ranges,
    quality_monitor,
    rover_outages,
    shadow,
    starloc_drive,
    targets,
)
from benchmarks.navigation.street import drive as street_drive
from benchmarks.navigation.street import exclusion
from benchmarks.planning import (
    choices,
    gates,
    path_benefit,
    placing,
    placing_at_scale,
    placing_baselines,
    plain_annealing,
    unreachables,
)
from benchmarks.planning import paths as planning
from benchmarks.service import (
    attacks,
    detector_streams,
    first_request,
    many_jobs,
    mixed_load,
    over_http,
    planner_page,
    plans_over_http,
    seen_and_unseen,
    slow_clients,
)
from benchmarks.terrain import ground, large_dems
from benchmarks.visibility import (
    accuracy,
    cover,
    dilution,
    exactness,
    hard_grounds,
    sites,
    situations,
    speed,
    volumes,
    woods,
)

__all__ = ["GROUPS", "QUICK"]

GROUPS: dict[str, tuple[Callable[[], report.Table], ...]] = {
    "exactness": (exactness.exactness, exactness.against_rays),
    "accuracy": (accuracy.accuracy, situations.fast_mode_by_situation),
    "hard": (hard_grounds.low_anchors, hard_grounds.very_rough),
    "speed": (speed.against_peers, speed.many_anchors, speed.growth, speed.many_lines),
    "dilution": (dilution.dilution_speed, dilution.one_per_set),
    "cover": (
        cover.canopy_length,
        cover.cost_of_canopy,
        cover.city,
        woods.fitted_to_davos,
        woods.surface_as_rock,
    ),
    "sites": (sites.all_places,),
    "volumes": (
        volumes.paper_case_speed,
        volumes.morphing_speed,
        volumes.one_moves,
        volumes.volume_growth,
        volumes.volume_memory,
    ),
    "placement": (
        placing.placing_speed,
        placing.cost_of_sight,
        placing.small_instances,
        placing.after_a_loss,
        placing_baselines.against_baselines,
        placing_baselines.moves_against_all,
    ),
    "scale": (placing_at_scale.at_scale,),
    "annealing": (plain_annealing.against_annealing,),
    "proofs": (placing_baselines.proofs,),
    "navigation": (
        bubbles.experiment,
        partial(bubbles.experiment, "drones"),
        bubbles.street_canyon,
        bubbles.real_ranges,
        bubbles.consistency,
        bubbles.bubble_speed,
    ),
    "inertial": (
        inertial.made_up_drive,
        inertial.outages,
        rover_outages.rover_outages,
        starloc_drive.ranges_dropped,
        inertial.inertial_speed,
        long_drive.long_drive,
    ),
    "monitor": (quality_monitor.steps_found, quality_monitor.real_phases, quality_monitor.monitor_speed),
    "deep": (deep.in_a_wood,),
    "lying": (lying_ranges.bubbles_that_hold,),
    "street": (street_drive.street, exclusion.exclusion),
    "shadow": (shadow.minute_of_shadow, few_satellites.few_satellites),
    "receiver": (receiver.recorded_sample, receiver.acquisition_speed, receiver.weak_signals, receiver.channel_speed),
    "targets": (targets.planes, targets.simulated_balls, targets.pairs, targets.poses, targets.real_balls),
    "differential": (differential.baselines,),
    "memory": (memory.memory, large_dems.by_windows),
    "service": (first_request.first_request, over_http.requests, plans_over_http.plans_over_http),
    "ground": (ground.tiles_to_map, ground.probes),
    "page": (planner_page.planner,),
    "attacks": (attacks.health_under_attack,),
    "strangers": (slow_clients.slow_clients, mixed_load.mixed),
    "store": (many_jobs.many_jobs,),
    "seeing": (seen_and_unseen.cost_of_being_seen,),
    "detectors": (detector_streams.streams,),
    "detection": (
        detector_proof.real_ranges,
        detector_odometry.odometry_on_plaza,
        detector_proof.false_positive_rates,
        detector_outliers.outliers,
        detector_faults.faults_named,
        detector_speed.detector_speed,
    ),
    "loop": (map_loop.map_loop, map_estimates.map_estimates),
    "loop-time": (map_loop.loop_speed, map_advice.advice_speed),
    "planning": (
        planning.random_paths,
        planning.first_path,
        planning.cost_in_three_seconds,
        path_benefit.benefit,
        planning.same_twice,
        unreachables.unreachables,
    ),
    "choices": (choices.other_ways, choices.replanning),
    "gates": (gates.gates,),
}
# the same tables on small grounds: to see that everything runs, not to be believed
QUICK: dict[str, tuple[Callable[[], report.Table], ...]] = {
    "exactness": (exactness.exactness, exactness.against_rays),
    "accuracy": (
        partial(accuracy.accuracy, fractal_posts=128),
        partial(situations.fast_mode_by_situation, count=1, dems=("gvi_vancouver_DEM.tif",)),
    ),
    "hard": (partial(hard_grounds.low_anchors, count=4), hard_grounds.very_rough),
    "speed": (
        partial(speed.against_peers, sizes=(128,)),
        partial(speed.many_anchors, posts=128, count=4),
        partial(speed.growth, fast_sizes=(128, 256), exact_sizes=(64, 128)),
        partial(speed.many_lines, count=1000),
    ),
    "dilution": (
        partial(dilution.dilution_speed, posts=128, points=2000),
        partial(dilution.one_per_set, posts=64, across=8),
    ),
    "cover": (
        partial(cover.canopy_length, lines=10),
        partial(cover.cost_of_canopy, posts=64, lines=1000),
        partial(cover.city, posts=128, across=15, rays=5000),
        woods.fitted_to_davos,
        partial(woods.surface_as_rock, post_m=8.0),
    ),
    "sites": (partial(sites.all_places, posts=128, sampled=20),),
    "volumes": (
        volumes.paper_case_speed,
        partial(volumes.morphing_speed, posts=96),
        partial(volumes.one_moves, posts=128),
        partial(volumes.volume_growth, sizes=(32, 48, 64, 96), layer_counts=(10, 20, 40, 80)),
        partial(volumes.volume_memory, cases=((64, 10), (64, 40))),
    ),
    "placement": (
        partial(placing.placing_speed, posts=128, candidates=60, real_candidates=40),
        partial(placing.cost_of_sight, sizes=(64, 128), candidates=16),
        partial(placing.small_instances, instances=1, candidates=9),
        partial(placing.after_a_loss, instances=1),
        partial(placing_baselines.against_baselines, problems=3, posts=48, sets=20),
        partial(placing_baselines.moves_against_all, cases=8, posts=24),
    ),
    "scale": (partial(placing_at_scale.at_scale, posts=400, candidates=60, range_m=2_000.0, count=3),),
    "annealing": (
        partial(plain_annealing.against_annealing, problems=2, posts=40, fewest=30, most=40, annealing_s=0.5),
    ),
    "proofs": (partial(placing_baselines.proofs, problems=4, posts=40, effort_s=0.5, peer_s=0.5),),
    "navigation": (
        partial(bubbles.experiment, count=5, every=20),
        partial(bubbles.experiment, "drones", count=5, every=20),
        partial(bubbles.street_canyon, count=3),
        bubbles.real_ranges,
        partial(bubbles.consistency, runs=50, steps=50),
        partial(bubbles.bubble_speed, points=1000),
    ),
    "inertial": (
        inertial.made_up_drive,
        partial(inertial.outages, drives=1),
        partial(starloc_drive.ranges_dropped, beginnings_s=(26.0,)),
        partial(inertial.inertial_speed, seconds=20.0),
        partial(long_drive.long_drive, steps=200_000),
    ),
    "monitor": (
        partial(quality_monitor.steps_found, epochs=4000),
        quality_monitor.real_phases,
        partial(quality_monitor.monitor_speed, epochs=2000),
    ),
    "differential": (differential.baselines,),
    "shadow": (partial(shadow.minute_of_shadow, drives=1), partial(few_satellites.few_satellites, drives=1)),
    "deep": (partial(deep.in_a_wood, drives=1, others=1, duration_s=58.1),),
    "lying": (partial(lying_ranges.bubbles_that_hold, runs=2),),
    "street": (street_drive.street, partial(exclusion.exclusion, every=100)),
    "receiver": (
        receiver.recorded_sample,
        partial(receiver.acquisition_speed, prns=4),
        partial(receiver.weak_signals, draws=2000),
        partial(receiver.channel_speed, channels=2, duration_s=0.1),
    ),
    "targets": (
        partial(targets.planes, 2),
        partial(targets.simulated_balls, 2),
        partial(targets.pairs, 2),
        partial(targets.poses, 1),
    ),
    "memory": (partial(memory.memory, posts=512), partial(large_dems.by_windows, posts=3000, range_m=300.0, anchors=4)),
    "service": (
        first_request.first_request,
        partial(over_http.requests, posts=128),
        partial(plans_over_http.plans_over_http, posts=128, watch_s=3.0, cancelled=1),
    ),
    "ground": (partial(ground.tiles_to_map, side=4, places=2), partial(ground.probes, questions=60)),
    "attacks": (partial(attacks.health_under_attack, seconds=1.0),),
    "strangers": (
        partial(slow_clients.slow_clients, seconds=2.0, attacks=("unread answers",)),
        partial(mixed_load.mixed, seconds=5.0),
    ),
    "store": (partial(many_jobs.many_jobs, jobs=500),),
    "seeing": (partial(seen_and_unseen.cost_of_being_seen, posts=64, maps=10, epochs=30),),
    "detectors": (partial(detector_streams.streams, seconds=2.0),),
    "detection": (
        detector_proof.real_ranges,
        detector_odometry.odometry_on_plaza,
        partial(detector_proof.false_positive_rates, epochs=20_000, searched=200),
        partial(detector_outliers.outliers, epochs=2000),
        partial(detector_faults.faults_named, logs=12),
        partial(detector_speed.detector_speed, epochs=100),
    ),
    "loop": (
        partial(map_loop.map_loop, drives=1),
        partial(map_estimates.map_estimates, drives=1),
    ),
    "loop-time": (
        partial(map_loop.loop_speed, drives=1),
        partial(map_advice.advice_speed, drives=2),
    ),
    "planning": (
        partial(planning.random_paths, count=20, posts=60),
        partial(planning.first_path, posts=128, count=4),
        partial(planning.cost_in_three_seconds, posts=80, count=5),
        partial(path_benefit.benefit, count=3, posts=60),
        partial(planning.same_twice, count=1),
        partial(unreachables.unreachables, count=12, posts=40),
    ),
    "choices": (
        partial(choices.other_ways, count=10, posts=60),
        partial(choices.replanning, posts=128, problems=1, starts=3),
    ),
    "gates": (partial(gates.gates, count=6),),
}

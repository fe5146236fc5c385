"""Blocks of bearings are shared out evenly, and answers do not depend on who shares them."""

import numpy as np
import numpy.typing as npt
import pytest

from compiled.read_only import read_only
from terrain import fractal
from visibility.sight.kernels import sweep as kernel
from visibility.sight.kernels.blocks import Block, owned_posts
from visibility.sight.sectors import Eye, Work, share_out

SHAPE = (220, 301)
EYES: list[Eye] = [(110.0, 150.0, 900.0), (5.25, 290.5, 900.0), (-40.0, 420.0, 1500.0)]
NO_DROP = (0.0, 0.0)


def _heights_m() -> npt.NDArray[np.float32]:
    return read_only(fractal(512, seed=3, relief_m=500.0).heights_m[: SHAPE[0], : SHAPE[1]].copy())


def _answered(work: Work, eyes: int) -> npt.NDArray[np.float32]:
    out_m = np.full((eyes, *SHAPE), np.nan, np.float32)
    blank_m, turned_m = read_only(np.full(max(SHAPE), np.nan, np.float32)), read_only(np.empty((0, 0), np.float32))
    kernel.sweep(_heights_m(), turned_m, blank_m, out_m, work.blocks, work.bins, 0)
    return out_m


@pytest.mark.parametrize("workers", [2, 5, 70])
def test_any_number_of_workers_gives_the_answers_of_one(workers: int) -> None:
    alone_m, together_m = (
        _answered(share_out(EYES, _heights_m(), (1e-6, 2e-6), 64, count), len(EYES)) for count in (1, workers)
    )
    np.testing.assert_array_equal(together_m, alone_m)
    # an eye over a post leaves that post to others; all else is answered
    assert np.argwhere(np.isnan(alone_m)).tolist() == [[0, 110, 150]]


@pytest.mark.parametrize("eye", [*EYES, (30.0, 300.0, 600.0), (0.0, 10.5, 600.0)])
def test_every_post_is_answered_by_one_block_alone(eye: Eye) -> None:
    work = share_out([eye], _heights_m(), NO_DROP, 64, 1)
    answers = np.zeros(SHAPE, np.int64)
    for number in range(len(work.blocks)):
        answers += ~np.isnan(_answered(Work(work.blocks, np.array([[number]])), 1)[0])
    own = [list(eye[:2])] if eye[0].is_integer() and eye[1].is_integer() and eye[0] >= 0 else []
    assert np.argwhere(answers != 1).tolist() == own


def _owners(eye: tuple[float, float], shape: tuple[int, int], rays: int, follow_borders: bool) -> npt.NDArray[np.int64]:
    """How many blocks answer for each post; the eye's own counts as answered."""
    flat_m, owners = np.zeros(shape, np.float32), np.zeros(shape, np.int64)
    for record in share_out([(*eye, 900.0)], flat_m, NO_DROP, rays, 2, follow_borders=follow_borders).blocks:
        block = Block(*record.item())
        by_line = owners if block.axis == 0 else owners.T
        for step in range(block.lines):
            line = block.first_line + block.direction * step
            start, stop = owned_posts(block, abs(line - block.along_0), by_line.shape[1])
            by_line[line, start : max(stop, start)] += 1
    row, col = eye
    if row.is_integer() and col.is_integer() and 0 <= row < shape[0] and 0 <= col < shape[1]:
        owners[int(row), int(col)] += 1
    return owners


@pytest.mark.parametrize("follow_borders", [False, True])
def test_every_post_has_one_owner_wherever_the_eye_is(follow_borders: bool) -> None:
    draw = np.random.default_rng(3)
    # on a line of posts, beyond the map: a cut among the rays to spare gave some posts two owners
    cases = [((16.0, -4.0), (17, 17), 256), ((49.0, -8.0), (50, 43), 64)]
    for number in range(200):
        at = draw.integers(-20, 60, 2) if number % 2 else draw.uniform(-20.0, 60.0, 2)
        shape = draw.integers(2, 50, 2)
        cases.append(((float(at[0]), float(at[1])), (int(shape[0]), int(shape[1])), int(draw.choice([64, 256]))))
    wrong = [case for case in cases if (_owners(*case, follow_borders) != 1).any()]
    assert wrong == []


@pytest.mark.parametrize("workers", [1, 2, 5, 70])
def test_every_block_is_dealt_once_and_rays_come_in_whole_steps(workers: int) -> None:
    work = share_out(EYES, _heights_m(), NO_DROP, 64, workers)
    assert sorted(work.bins[work.bins >= 0].tolist()) == list(range(len(work.blocks)))
    assert len(work.bins) == workers
    assert ((work.blocks["rays"] - 1) % kernel.COARSEST == 0).all()
    assert (work.blocks["rays"] > 1).all()


@pytest.mark.parametrize("size", [32, 100_000])
@pytest.mark.parametrize("eye", EYES)
def test_blocks_of_another_size_answer_alike_but_for_rays_that_meet_a_post_exactly(eye: Eye, size: int) -> None:
    usual_m, other_m = (_answered(share_out([eye], _heights_m(), NO_DROP, rays, 1), 1)[0] for rays in (128, size))
    # rounding decides in which of two cells such a ray goes on
    assert (np.abs(usual_m - other_m) > 1e-3).mean() < 1e-3


@pytest.mark.parametrize("eye", [(0.0, 0.0, 900.0), (110.0, 0.0, 900.0), (110.0, 290.0, 900.0)])
def test_two_workers_have_alike_to_do_wherever_the_eye_is(eye: Eye) -> None:
    work = share_out([eye], _heights_m(), NO_DROP, 100_000, 2)
    posts = [_posts_answered(work, hand) for hand in work.bins]
    assert sum(posts) == SHAPE[0] * SHAPE[1] - 1
    # what runs over columns costs more, so equal numbers of posts are not what is asked for
    assert max(posts) <= 1.3 * min(posts)


def _posts_answered(work: Work, hand: npt.NDArray[np.int64]) -> int:
    answered_m = _answered(Work(work.blocks, hand[np.newaxis]), 1)
    return int((~np.isnan(answered_m)).sum())

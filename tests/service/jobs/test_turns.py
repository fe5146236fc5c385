"""Places are taken in turn by client: many of one do not hold up the one of another, and none is lost."""

from __future__ import annotations

import asyncio

import pytest

from service.jobs.sharing.turns import Turns


async def _take(turns: Turns, client: str, order: list[str]) -> None:
    await turns.acquire(client)
    order.append(client)
    await asyncio.sleep(0)
    turns.release()


def test_one_of_each_client_after_another() -> None:
    async def play() -> list[str]:
        turns, order = Turns(1), list[str]()
        tasks = [asyncio.create_task(_take(turns, "a", order)) for _ in range(256)]
        await asyncio.sleep(0)
        tasks += [asyncio.create_task(_take(turns, client, order)) for client in "bbcb"]
        await asyncio.gather(*tasks)
        return order

    order = asyncio.run(play())
    assert len(order) == 260
    # one of them has the place and one more may be due before the others came
    assert order.index("b") <= 3
    assert order.index("c") <= 4
    assert max(number for number, client in enumerate(order) if client == "b") <= 10


@pytest.mark.parametrize("places", [1, 3])
def test_places_survive_whoever_gives_up_waiting(places: int) -> None:
    async def play() -> None:
        turns = Turns(places)
        for _ in range(places):
            await turns.acquire("a")
        waiting = [asyncio.create_task(turns.acquire(f"c{n % 4}")) for n in range(20)]
        await asyncio.sleep(0)
        turns.release()  # one of them has it now, and is told so in the next round
        for task in waiting:
            task.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)
        assert [turns.waiting(f"c{n}") for n in range(4)] == [0] * 4
        for _ in range(places - 1):
            turns.release()
        for _ in range(places):
            async with asyncio.timeout(1.0):
                await turns.acquire("b")
        assert not asyncio.create_task(turns.acquire("b")).done()

    asyncio.run(play())

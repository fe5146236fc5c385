"""A dashboard in the terminal: watches a session of the service, whoever feeds it, and shows the word on each anchor.

python examples/dashboard.py http://127.0.0.1:8000 DETECTOR_ID [EPOCHS]
"""

import json
import os
import sys
from itertools import count, islice

import httpx
from websockets.sync.client import connect

COLOURS = {"clear": "\033[32m", "occluded": "\033[31m", "too short": "\033[35m", "unknown": "\033[33m"}


def main(url: str, detector_id: str, epochs: int | None = None) -> None:
    """Show so many epochs, or all there will be."""
    headers = {"Authorization": f"Bearer {key}"} if (key := os.environ.get("SIGHTLINE_KEY")) else {}
    with httpx.Client(base_url=url, trust_env=False, headers=headers) as http:
        links = http.get(f"/detectors/{detector_id}").raise_for_status().json()["links"]
    address = f"{url.replace('http', 'ws', 1)}{links['stream']}?watch=true"
    with connect(address, proxy=None, additional_headers=headers) as stream:
        print("watching", detector_id, flush=True)
        for _ in islice(count(), epochs):
            answer = json.loads(stream.recv())
            fix = answer["position"]
            place = "no position" if fix is None else f"{fix['east_m']:.2f} E {fix['north_m']:.2f} N"
            marks = " ".join(
                f"{COLOURS[one['sight']]}{one['anchor_id']} {one['excess_m'] or 0.0:+.1f} m\033[0m"
                for one in answer["verdicts"]
            )
            print(f"{answer['time_s']:8.1f} s  {place:>28}  {answer['planning']:<11} {marks}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else None)

# syntax=docker/dockerfile:1
# Two stages: the first builds a wheel and installs it into a virtual environment, the second carries only that
# environment, runs as a user without rights and has the kernels compiled.
#
#   docker build -t sightline .
#   docker run --rm -p 8000:8000 -v sightline-data:/data sightline
#
# numba's cache is valid for one kind of CPU. The build compiles for the CPU it runs on; on another kind `serve` compiles
# once more while it starts, never in a request. An image that starts warm on a mixed fleet names the common baseline:
#
#   FROM sightline
#   ENV NUMBA_CPU_NAME=x86-64-v3 NUMBA_CPU_FEATURES=+avx,+avx2,+fma
#   RUN sightline warm-up
#
# docs/decisions/0005-kernels-are-compiled-before-requests.md tells why.

# Every package of the lock has a wheel for this Python on x86-64. On 64-bit ARM embreex has none, and there is no image.
#
# For a build that can be repeated name the base by its digest, as `docker buildx imagetools inspect python:3.12-slim` tells it:
#   docker build --build-arg BASE=python:3.12-slim@sha256:... .
ARG BASE=python:3.12-slim

FROM ${BASE} AS builder
WORKDIR /src
RUN python -m venv /opt/sightline
COPY pyproject.toml README.md LICENSE ./
COPY compiled ./compiled
COPY terrain ./terrain
COPY gnss ./gnss
COPY visibility ./visibility
COPY detection ./detection
COPY navigation ./navigation
COPY planning ./planning
COPY service ./service
COPY dem_samples ./dem_samples
COPY locks ./locks
# exactly what was locked, each file by its hash, what builds ours too, and of ours nothing but ours
RUN /opt/sightline/bin/python -m pip install --no-cache-dir --require-hashes --requirement locks/product.txt \
    && python -m pip install --no-cache-dir --require-hashes --requirement locks/build.txt \
    && python -m pip wheel --no-cache-dir --no-deps --no-build-isolation --wheel-dir /wheels . \
    && /opt/sightline/bin/python -m pip install --no-cache-dir --no-deps /wheels/sightline-*.whl

FROM ${BASE} AS runtime
# libgomp1: numba's OpenMP layer, the one that bears two requests calling parallel kernels at once
# libexpat1: the GDAL inside the rasterio wheel takes it from the system
RUN apt-get update \
    && apt-get install --no-install-recommends --yes libexpat1 libgomp1 \
    && rm -rf /var/lib/apt/lists/* \
    && groupadd --system --gid 10001 sightline \
    && useradd --system --uid 10001 --gid sightline --home-dir /home/sightline --create-home sightline \
    && install --directory --owner=sightline --group=sightline /data /var/cache/sightline
COPY --from=builder /opt/sightline /opt/sightline
ENV PATH=/opt/sightline/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    MPLCONFIGDIR=/var/cache/sightline/matplotlib \
    NUMBA_CACHE_DIR=/var/cache/sightline/numba \
    SIGHTLINE_HOST=0.0.0.0 \
    SIGHTLINE_PORT=8000 \
    SIGHTLINE_DATA_FOLDER=/data
USER sightline
WORKDIR /home/sightline
RUN sightline warm-up
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=120s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request as r; r.urlopen(f'http://127.0.0.1:{os.environ[\"SIGHTLINE_PORT\"]}/ready', timeout=4)"]
CMD ["sightline", "serve"]

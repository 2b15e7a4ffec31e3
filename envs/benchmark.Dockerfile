# The benchmark in a container that asks the network for nothing, neither while it is built nor while it runs.
# Once, where there is a network:
#   docker pull python:3.11-bookworm
#   docker run --rm -v "$PWD:/lowalt" -w /lowalt python:3.11-bookworm \
#     pip wheel --wheel-dir wheels -c envs/constraints.txt pip uv setuptools '.[workflow,cost,recognition]'
# Then, without one:
#   docker build --network none -t lowalt-40 -f envs/benchmark.Dockerfile .
#   docker run --rm --network none -v lowalt-40:/lowalt/results lowalt-40
# The image has `make`, and no package of Debian is missing: only meshes need libGL, and the benchmark has none.
FROM python:3.11-bookworm
WORKDIR /lowalt
ENV PIP_NO_INDEX=1 PIP_FIND_LINKS=/wheels UV_NO_INDEX=1 UV_OFFLINE=1 UV_FIND_LINKS=/wheels
COPY Makefile pyproject.toml setup.py README.md LICENSE Snakefile ./
COPY envs envs
COPY src src
COPY workflow workflow
COPY config config
COPY profiles profiles
COPY results/reference results/reference
RUN --mount=type=bind,source=wheels,target=/wheels make .venv/set-up
ENTRYPOINT ["make"]
CMD ["benchmark"]

# Runs tools/demo on lavapipe:
#   docker build --tag lumivox . && docker run --rm --volume "$PWD/out:/lumivox/out" lumivox
FROM debian:bookworm
RUN apt-get update && apt-get install --yes ca-certificates curl gcc g++ git python3 \
    && curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y --profile minimal
ENV PATH="/root/.cargo/bin:$PATH"
WORKDIR /lumivox
COPY . .
RUN tools/setup && cargo build --release --locked
CMD ["tools/demo"]

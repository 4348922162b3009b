# Where CI runs: Debian 12 with Rust, three Vulkan drivers on the CPU and what setup.sh installs, whose list of packages is the
# only one. The checkout is mounted over it:
#   docker build -t meniscus-ci . && docker run --rm -v "$PWD":/meniscus meniscus-ci .ci/run
FROM rust:1-bookworm
RUN rustup component add rustfmt clippy
WORKDIR /meniscus
COPY setup.sh .
RUN ./setup.sh
CMD ["bash"]

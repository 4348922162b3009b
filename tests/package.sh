#!/usr/bin/env bash
# Makes the package that is to be published, shaders prebuilt, under target/package; and checks it as somebody would use it who has
# nothing of this checkout: the renderer builds without shaderc and draws, and the prebuilt shaders are those of the packaged glsl/.
#   tests/package.sh [OPTIONS OF cargo package]    such as --allow-dirty
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD

# Where cargo has let build.rs write.
made() { cargo check --quiet --locked --lib "$@" --message-format json | grep -o '"out_dir":"[^"]*/meniscus-[^"]*"' | cut -d'"' -f4 | tail -1; }

mkdir -p prebuilt
cp "$(made)/shaders.rs" prebuilt/shaders.rs
cargo package --quiet --locked --no-verify "$@"
crate=$(ls -t "$root"/target/package/meniscus-*.crate | head -1)
[ "$(stat -c %s "$crate")" -lt 10485760 ] || { echo "$crate is larger than crates.io takes (10 MiB)" >&2; exit 1; }

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
tar -xzf "$crate" -C "$folder" --strip-components 1
cd "$folder"
# Nothing of this checkout's settings: no shaderc of ours, no drivers of ours.
export CARGO_TARGET_DIR=$root/target/packaged CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_PROFILE_DEV_DEBUG=0
if cargo tree --locked --no-default-features --edges normal,build | grep -q shaderc; then
  echo "the renderer alone would compile shaderc" >&2
  exit 1
fi
SHADERC_LIB_DIR=/nowhere cargo run --quiet --locked --no-default-features --example embed -- "$folder/water.ppm"
compiled=$(SHADERC_LIB_DIR=$root/target/shaderc made --no-default-features --features glsl)/shaders.rs
cmp prebuilt/shaders.rs "$compiled"
echo "${crate#"$root/"}: $(($(stat -c %s "$crate") / 1024)) KiB, builds and draws by itself"

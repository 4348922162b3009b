#!/usr/bin/env bash
# Makes the package that is to be published, target/package/meniscus-VERSION.crate, of what git has of this tree. Its shaders are
# prebuilt, so that it does without shaderc. Then builds it as somebody would who has nothing of this checkout, and draws with it.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/staged" "$folder/unpacked"

# What build.rs makes of the shaders here, and a build script that takes it from the package.
made=$(cargo check --quiet --locked --lib --message-format json | grep -o '"out_dir":"[^"]*/meniscus-[^"]*"' | cut -d'"' -f4 | tail -1)
git ls-files -z | xargs -0 cp --parents -t "$folder/staged"
cd "$folder/staged"
mkdir prebuilt
cp "$made/shaders.rs" prebuilt/
git -C "$root" rev-parse --short=12 HEAD > prebuilt/commit
mv build/prebuilt.rs build.rs
sed -i '/^shaderc = /d; /^\[workspace\]/,/^$/d' Cargo.toml
# Dependencies are those of the checkout, built already.
export CARGO_TARGET_DIR=$root/target
cargo package --quiet --no-verify --allow-dirty
crate=$(ls -t "$root"/target/package/meniscus-*.crate | head -1)
size=$(stat -c %s "$crate")
[ "$size" -lt 10485760 ] || { echo "$crate is larger than crates.io takes (10 MiB)" >&2; exit 1; }

tar -xzf "$crate" -C "$folder/unpacked" --strip-components 1
cd "$folder/unpacked"
if grep -q 'name = "shaderc' Cargo.lock; then echo "the package would compile shaderc" >&2; exit 1; fi
cargo run --quiet --locked --no-default-features --features gpu-allocator --example embed -- "$folder/water.ppm"
[ -s "$folder/water.ppm" ]
# The command line builds from it too.
cargo check --quiet --locked --bins
echo "${crate#"$root/"}: $((size / 1024)) KiB, builds and draws by itself"

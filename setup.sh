#!/usr/bin/env bash
# Installs what meniscus needs beside a Rust toolchain on Debian 12 or Ubuntu 24.04, and prepares shaderc:
# building it from source takes ten minutes and Debian's shared library does not link, so the static archives
# of the three packages it is made of are merged into one (two seconds). Safe to run again.
set -euo pipefail
cd "$(dirname "$0")"

packages=(build-essential binutils libvulkan1 mesa-vulkan-drivers vulkan-validationlayers
          libshaderc-dev glslang-dev spirv-tools)
# SwiftShader, a second Vulkan driver, comes with Debian's Chromium; Ubuntu ships that as a snap, without it.
optional=(chromium-common)

missing() { ! dpkg-query -W -f='${Status}' "$1" 2>/dev/null | grep -q 'ok installed'; }
wanted=(); for p in "${packages[@]}"; do missing "$p" && wanted+=("$p"); done
extra=(); for p in "${optional[@]}"; do missing "$p" && [ ! -e "target/no-$p" ] && extra+=("$p"); done
if [ ${#wanted[@]} -gt 0 ] || [ ${#extra[@]} -gt 0 ]; then
  as_root=(); [ "$(id -u)" = 0 ] || as_root=(sudo)
  export DEBIAN_FRONTEND=noninteractive
  "${as_root[@]}" apt-get update -qq
  [ ${#wanted[@]} = 0 ] || "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${wanted[@]}" >/dev/null
  for p in "${extra[@]}"; do
    "${as_root[@]}" apt-get install -y -qq --no-install-recommends "$p" >/dev/null 2>&1 ||
      { mkdir -p target; touch "target/no-$p"; echo "setup: $p is not to be had here; tests run on the other drivers" >&2; }
  done
fi

lib=/usr/lib/$(gcc -dumpmachine)
out=target/shaderc
mkdir -p "$out"
[ -f "$lib/libshaderc_combined.a" ] || { echo "setup: $lib/libshaderc_combined.a is missing (package libshaderc-dev)" >&2; exit 1; }
if [ ! -f "$out/libshaderc_combined.a" ] || [ "$lib/libshaderc_combined.a" -nt "$out/libshaderc_combined.a" ]; then
  {
    echo "create $out/libshaderc_combined.a.new"
    for a in shaderc_combined glslang MachineIndependent GenericCodeGen OGLCompiler OSDependent HLSL SPIRV \
             SPIRV-Tools-opt SPIRV-Tools; do
      # Newer glslang has folded some of these into others.
      [ ! -f "$lib/lib$a.a" ] || echo "addlib $lib/lib$a.a"
    done
    echo save
    echo end
  } | ar -M
  mv "$out/libshaderc_combined.a.new" "$out/libshaderc_combined.a"
fi
# Chromium also carries a validation layer years newer than Debian's; CI runs the GPU tests under both.
layer=/usr/lib/chromium/libVkLayer_khronos_validation.so
manifest=/usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json
if [ -f "$layer" ] && [ -f "$manifest" ]; then
  mkdir -p target/layers
  sed "s#\"library_path\": *\"[^\"]*\"#\"library_path\": \"$layer\"#" "$manifest" > target/layers/VkLayer_khronos_validation.json
fi
echo "setup: done"

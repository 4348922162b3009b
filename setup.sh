#!/usr/bin/env bash
# Installs what meniscus needs beside a Rust toolchain on Debian 12 or Ubuntu 24.04, and prepares shaderc:
# building it from source takes ten minutes and Debian's shared library does not link, so the static archives
# of the three packages it is made of are merged into one (two seconds). Safe to run again.
set -euo pipefail
cd "$(dirname "$0")"

packages=(build-essential binutils libvulkan1 mesa-vulkan-drivers vulkan-validationlayers
          libshaderc-dev glslang-dev spirv-tools
          # For the C interface's tests: Vulkan's headers, and what finds an installed library.
          libvulkan-dev pkg-config cmake
          # For the export script of docs/blender.md, which a test runs.
          python3
          # What a window loads when it starts, and a display without a screen to test it in.
          libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0 xvfb)
# SwiftShader, a second Vulkan driver, comes with Debian's Chromium; Ubuntu ships that as a snap, without it. A test captures
# frames with gfxreconstruct.
optional=(chromium-common gfxreconstruct)

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
      { mkdir -p target; touch "target/no-$p"; echo "setup: $p is not to be had here; tests do without it" >&2; }
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
# A third Vulkan driver: Mesa 25's lavapipe, from Debian 12's backports, and RADV of the same package, whose null hardware
# compiles for GPUs that are not there. It is not installed, only unpacked, and it finds what
# it links with among Debian's own libraries; setup goes on without it wherever it cannot be had.
mesa=target/mesa25
unpack_mesa() {
  grep -q '^VERSION_CODENAME=bookworm$' /etc/os-release || { echo "this is not Debian 12"; return 1; }
  rm -rf "$mesa" && mkdir -p "$mesa"/{lists,cache,debs,root} && cd "$mesa" || return 1
  local here=$PWD suite
  for suite in bookworm bookworm-backports; do
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian $suite main"
  done > sources.list
  # Lists and downloads of its own, so that nothing of the system's is written and no root is needed.
  local apt=(apt-get -qq -o "Dir::Etc::SourceList=$here/sources.list" -o Dir::Etc::SourceParts=- -o "Dir::State::Lists=$here/lists"
             -o "Dir::Cache=$here/cache" -o APT::Sandbox::User= -o Acquire::Retries=1 -o Acquire::http::Timeout=20
             -o Acquire::Languages=none -o APT::Update::Error-Mode=any)
  "${apt[@]}" update || return 1
  local package=mesa-vulkan-drivers/bookworm-backports
  (cd debs && "${apt[@]}" download "$package") && dpkg-deb -x debs/mesa-vulkan-drivers_*.deb root || return 1
  local driver library
  # Lavapipe last: where its manifest is there, all is.
  for driver in radeon lvp; do
    library=$here/libvulkan_$driver.so
    find root -name "libvulkan_$driver.so" -exec mv -t . {} + && [ -f "$library" ] || { echo "the package has no $driver"; return 1; }
    # The loader would complain in every run of a driver that links with newer libraries than are here.
    ! ldd -r "$library" 2>&1 | grep -E 'not found|undefined symbol' || return 1
    sed "s#\"library_path\": *\"[^\"]*\"#\"library_path\": \"$library\"#" root/usr/share/vulkan/icd.d/${driver}_icd*.json > manifest.new
    grep -qF "\"$library\"" manifest.new && mv manifest.new "${driver}_icd.json" || return 1
  done
  rm -rf lists cache debs root sources.list
}
# The manifest has an absolute path: a checkout that was moved unpacks anew. What failed once is not tried again.
if ! { grep -qsF "\"$PWD/$mesa/" "$mesa/lvp_icd.json" && [ -f "$mesa/radeon_icd.json" ]; } && [ ! -e target/no-mesa25 ]; then
  if ! why=$(unpack_mesa 2>&1); then
    rm -rf "$mesa" && touch target/no-mesa25
    echo "setup: no third driver, Mesa 25 of Debian's backports (${why##*$'\n'}); remove target/no-mesa25 to try again" >&2
  fi
fi
echo "setup: done"

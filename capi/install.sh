#!/usr/bin/env bash
# Builds the C library and installs it: header, shared and static library, pkg-config file, CMake package.
#   capi/install.sh --prefix DIR [--profile NAME] [--libdir DIR-IN-PREFIX]     release and lib unless given
set -euo pipefail
cd "$(dirname "$0")"
prefix='' profile=release libdir=lib
while [ $# -gt 0 ]; do
  case $1 in
    --prefix) prefix=$2 ;;
    --profile) profile=$2 ;;
    --libdir) libdir=$2 ;;
    *) echo "install.sh: $1 is not known: capi/install.sh --prefix DIR [--profile NAME] [--libdir DIR]" >&2; exit 2 ;;
  esac
  shift 2
done
[ -n "$prefix" ] || { echo "install.sh: give --prefix DIR, such as --prefix /usr/local" >&2; exit 2; }
case $prefix in /*) ;; *) prefix=$OLDPWD/$prefix ;; esac

cargo=${CARGO:-cargo}
# From where .cargo/config.toml says where shaderc is.
cd ..
"$cargo" build --locked -p meniscus-capi --profile "$profile"
metadata=$("$cargo" metadata --locked --format-version 1 --no-deps)
target=$(sed -n 's/.*"target_directory":"\([^"]*\)".*/\1/p' <<< "$metadata")
version=$(sed -n 's/^version = "\(.*\)"/\1/p' capi/Cargo.toml | head -1)
abi=$(sed -n 's/^#define MENISCUS_ABI_VERSION \([0-9]*\)$/\1/p' capi/include/meniscus.h)
built=$target/$profile
[ "$profile" != dev ] || built=$target/debug

install -d "$prefix/include" "$prefix/$libdir/pkgconfig" "$prefix/$libdir/cmake/meniscus"
install -m 644 capi/include/meniscus.h "$prefix/include/"
install -m 644 "$built/libmeniscus.a" "$prefix/$libdir/"
install -m 755 "$built/libmeniscus.so" "$prefix/$libdir/libmeniscus.so.$abi"
ln -sf "libmeniscus.so.$abi" "$prefix/$libdir/libmeniscus.so"
for file in meniscus.pc meniscus-config.cmake meniscus-config-version.cmake; do
  to=$prefix/$libdir/cmake/meniscus
  [ $file != meniscus.pc ] || to=$prefix/$libdir/pkgconfig
  sed -e "s#@prefix@#$prefix#g" -e "s#@libdir@#$libdir#g" -e "s#@version@#$version#g" -e "s#@abi@#$abi#g" \
    "capi/packaging/$file.in" > "$to/$file"
done

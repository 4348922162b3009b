#!/usr/bin/env bash
# Plants each mistake of tests/mutants/ in turn and checks that the test named beside it fails, having passed before. Half a
# minute each, so CI plants a few of them at a time. Works on a copy: your tree is not touched. A line is file, text, what replaces it,
# test (of `--test gpu`; with `cpu::`, `cli::`, `view::`, `memory::` or `endurance::` before it of those, with `lib::` of the library, with
# `capi::` and `capilib::` of the C interface, with `wgpu::` and `wgpulib::` of the host in wgpu, with `tracy::` and `tracylib::` of those with
# that feature), separated by " ::: ".
#   tests/mutants.sh                    all of them
#   tests/mutants.sh PATTERN            lines that the extended regular expression finds
#   tests/mutants.sh --sample 3 [DAY]   three of them: other ones each day (days since 1970 unless given), all in turn
set -euo pipefail
cd "$(dirname "$0")/.."
mapfile -t lines < <(grep -hv '^#' tests/mutants/*.txt | grep .)
if [ "${1:-}" = --sample ]; then
  day=${3:-$(($(date +%s) / 86400))} all=("${lines[@]}") lines=()
  # Lines of one file lie together: steps of about a third of the list make a sample of different ones.
  for ((k = 0; k < $2; k++)); do lines+=("${all[(day + k * ${#all[@]} / $2) % ${#all[@]}]}"); done
  echo "day $day: ${#lines[@]} of ${#all[@]}; repeat with tests/mutants.sh --sample $2 $day"
else
  mapfile -t lines < <(printf '%s\n' "${lines[@]}" | grep -E -- "${1:-}")
fi

copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
git ls-files -z | xargs -0 cp --parents -t "$copy"
mkdir -p "$copy/target"
for made in shaderc mesa25 layers; do [ ! -e "target/$made" ] || ln -s "$PWD/target/$made" "$copy/target/$made"; done
export CARGO_TARGET_DIR=$PWD/target/mutants SHADERC_LIB_DIR=${SHADERC_LIB_DIR:-$PWD/target/shaderc}
# Dependencies are what they are: taken over from the usual build, where there is one. Ours are not.
if [ ! -e target/mutants ] && [ -d target/debug/deps ]; then
  (cd target && find debug/deps debug/build debug/.fingerprint -type f ! -path '*meniscus*' -regextype posix-extended \
     ! -regex '.*/(gpu|cpu|cli|endurance|memory|view|fuzz|embed|capi|host)-[^/]*(/.*)?' -print0 |
     { mkdir -p mutants && xargs -0 cp -l --parents -t mutants; })
fi

run() { # tests of one binary, in the copy
  local binary=(--test "$1")
  [ "$1" != lib ] || binary=(--lib)
  [ "$1" != capi ] || binary=(-p meniscus-capi --test capi)
  [ "$1" != capilib ] || binary=(-p meniscus-capi --lib)
  [ "$1" != wgpu ] || binary=(-p meniscus-wgpu --test host)
  [ "$1" != wgpulib ] || binary=(-p meniscus-wgpu --lib)
  [ "$1" != tracy ] || binary=(--no-default-features --features io,host,tracy --test tracy)
  [ "$1" != tracylib ] || binary=(--no-default-features --features io,host,tracy --lib)
  (cd "$copy" && timeout 900 cargo test --quiet "${binary[@]}" -- --exact "${@:2}" > mutant.log 2>&1)
}
place() { # binary and name of a test
  case $1 in
    endurance::* | memory::* | cpu::* | cli::* | view::* | lib::* | capi::* | capilib::* | wgpu::* | wgpulib::* | tracy::* | tracylib::*) binary=${1%%::*} name=${1#*::} ;;
    *) binary=gpu name=$1 ;;
  esac
}
# Without a mistake they pass, or their failing would say nothing.
for each in gpu endurance memory cpu cli view lib capi capilib wgpu wgpulib tracy tracylib; do
  sound=()
  for line in "${lines[@]}"; do
    place "${line##* ::: }"
    [ "$binary" != $each ] || sound+=("$name")
  done
  [ ${#sound[@]} = 0 ] || run $each "${sound[@]}" || { tail -40 "$copy/mutant.log"; exit 1; }
done

survived=0
for line in "${lines[@]}"; do
  IFS=$'\t' read -r file from to test <<< "${line// ::: /$'\t'}"
  FROM=$from TO=$to perl -0pi -e 'my $n = s/\Q$ENV{FROM}\E/$ENV{TO}/g; die "$ARGV: found $n times: $ENV{FROM}\n" if $n != 1' "$copy/$file"
  place "$test"
  code=0
  run "$binary" "$name" || code=$?
  if [ $code = 0 ]; then
    echo "SURVIVED  $file: $from -> $to ($test)"
    survived=$((survived + 1))
  elif [ $code = 124 ]; then
    echo "TOO LONG  $file: $from -> $to ($test)"
    survived=$((survived + 1))
  elif grep -q "could not compile\|custom build command" "$copy/mutant.log"; then
    echo "NOT BUILT $file: $from -> $to"
    survived=$((survived + 1))
  else
    echo "caught    $file: $from -> $to ($test)"
  fi
  cp "$file" "$copy/$file"
done
echo "${#lines[@]} planted, $survived survived"
[ "$survived" = 0 ] && [ "${#lines[@]}" -gt 0 ]

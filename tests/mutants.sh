#!/usr/bin/env bash
# Plants each mistake of tests/mutants.txt in turn and checks that the test named beside it fails. Ten seconds to a minute
# each, so not part of every CI run. Works on a copy: your tree is not touched. An argument selects lines by pattern.
set -euo pipefail
cd "$(dirname "$0")/.."
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
git ls-files -z | xargs -0 cp --parents -t "$copy"
mkdir -p target/mutants "$copy/target" && cp -r target/shaderc "$copy/target/"
export CARGO_TARGET_DIR=$PWD/target/mutants
survived=0 planted=0
while IFS= read -r line; do
  case $line in "#"* | "") continue ;; esac
  [[ $line == *"${1:-}"* ]] || continue
  IFS=$'\t' read -r file from to test <<< "${line// ::: /$'\t'}"
  FROM=$from TO=$to perl -0pi -e 'my $n = s/\Q$ENV{FROM}\E/$ENV{TO}/g; die "$ARGV: found $n times: $ENV{FROM}\n" if $n != 1' "$copy/$file"
  planted=$((planted + 1))
  binary=gpu
  [[ $test == endurance::* ]] && binary=endurance
  if (cd "$copy" && cargo test --quiet --test "$binary" -- --exact "${test#endurance::}" > mutant.log 2>&1); then
    echo "SURVIVED  $file: $from -> $to ($test)"
    survived=$((survived + 1))
  elif grep -q "error: could not compile" "$copy/mutant.log"; then
    echo "NOT BUILT $file: $from -> $to"
    survived=$((survived + 1))
  else
    echo "caught    $file: $test"
  fi
  cp "$file" "$copy/$file"
done < tests/mutants.txt
echo "$planted planted, $survived survived"
[ "$survived" = 0 ] && [ "$planted" -gt 0 ]

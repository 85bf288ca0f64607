#!/bin/sh
# Stands in for any of the four tools, by the name it is called by: logs the call, writes outputs that follow from what
# the real tool would depend on, and leaves an identical output alone. Beside it, NAME.exit holds another exit code
# (with 3 the output is written, with others not) and NAME.before a command to run first.
name=$(basename "$0")
here=$(dirname "$0")
echo "$name $1" >> "$here/log"
code=0
[ -e "$here/$name.exit" ] && code=$(cat "$here/$name.exit")
[ -e "$here/$name.before" ] && . "$here/$name.before"

output= mesh= depfile= png= camera= flags= input=$2
shift 2
while [ $# -gt 0 ]; do
  case $1 in
  -o) output=$2; shift ;;
  --mesh) mesh=$2; shift ;;
  --depfile) depfile=$2; shift ;;
  --png) png=$2; shift ;;
  --camera) camera=$2; shift ;;
  *) flags="$flags $1" ;;
  esac
  shift
done

# Keeps the old file where the new text is the same.
keep() {
  cat > "$1.new"
  if cmp -s "$1.new" "$1"; then rm "$1.new"; else mv "$1.new" "$1"; fi
}

if [ ! -e "$input" ]; then echo "$name: error: $input: cannot read; did you mean another?" >&2; exit 1; fi
if [ "$code" != 0 ] && [ "$code" != 3 ]; then echo "$name: error: told to fail" >&2; exit "$code"; fi

case $name in
mesh-tool)
  folder=$(dirname "$input")
  mtl=$folder/$(sed -n 's/^mtllib //p' "$input")
  toml=${input%.obj}.toml
  stem=${output%.*}
  surfaces=$(awk '/^newmtl/ {n = $2} /^Ke/ {print n, ($2 + $3 + $4 > 0 ? "emits" : "dark")}' "$mtl")
  sides=$([ -e "$toml" ] && grep two_sided "$toml")
  grep -E '^(newmtl|Kd|Ke)' "$mtl" | keep "$stem.materials"
  if [ -n "$depfile" ]; then
    echo "$surfaces $sides" | keep "$stem.surfaces"
    escaped=$(echo "$mtl" | sed 's/ /\\ /g')
    [ -e "$toml" ] || toml=
    printf '%s: %s \\\n  %s %s\n' "$output" "$input" "$escaped" "$toml" | keep "$depfile"
  else
    (grep -v '^#' "$input"; echo "$surfaces $sides $flags") | keep "$output"
  fi ;;
formfactor-tool) (cat "$input"; echo "$flags") | cksum | keep "$output" ;;
solve-tool) (cat "$input" "${mesh%.mesh}.materials"; echo "$flags") | cksum | keep "$output" ;;
shade-tool)
  (cat "$input" ${camera:+"$camera"}; echo "$flags") | cksum > "$output.all"
  keep "$output" < "$output.all"
  keep "$png" < "$output.all"
  rm "$output.all" ;;
esac
echo '{}' > "$output.report.json"
exit "$code"

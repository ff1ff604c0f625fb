#!/bin/sh
# run.sh KIND PYTHON: builds the extensions with sanitizers of GCC's, KIND "address" (and undefined behaviour) or "thread", in a
# folder of their own, and runs tests of what is native on them, with PYTHON's packages. Fails where a sanitizer finds something.
set -eu
kind=$1 python=$(realpath -s "$2")
cd "$(dirname "$0")/../.."
build=$PWD/build/sanitize-$kind
library() { realpath "$(g++ -print-file-name="lib$1.so")"; }

tests="slicing/test_bends.py slicing/test_layers.py::test_threads_and_the_choice_of_layers_do_not_matter
    mesh/test_check.py::test_thread_count_does_not_matter mesh/test_contour.py::test_threads_do_not_matter
    mesh/test_extract.py::test_threads_do_not_change_a_byte mesh/test_projection.py
    mesh/test_simplify.py::test_the_result_is_the_same_for_any_number_of_threads"
if [ "$kind" = thread ]; then
    flags="-std=c++20 -fsanitize=thread -include $PWD/tests/sanitize/threads.h"
    loaded=$(library tsan)
else
    flags="-fsanitize=address,undefined -fno-sanitize-recover=all"
    loaded="$(library asan) $(library ubsan)"
    tests="$tests mesh/test_check.py printing/test_sampled_solids.py slicing/test_layer_runs.py volume/test_grid.py"  # not for races: the library of OpenVDB waits by TBB
fi

mkdir -p "$build"
if [ "$kind" = thread ]; then
    # shellcheck disable=SC2086
    g++ -O1 -g $flags tests/sanitize/race.cpp -ltbb -o "$build/race"
    ! setarch -R "$build/race" 2>/dev/null || { echo "the sanitizer does not see a race between tasks" >&2; exit 1; }
fi

PATH=$(dirname "$python"):$PATH cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=None -DPython_EXECUTABLE="$python" \
    -DCMAKE_CXX_FLAGS="-O1 -g -fno-omit-frame-pointer $flags"
cmake --build "$build" -j 2
rm -rf "$build/tree"
mkdir "$build/tree"
cp -r fracslice cli scenes tests pyproject.toml "$build/tree"
cp "$build"/_*.so "$build/tree/fracslice"

# Without `site` (-S) no editable install hides the copy. The C++ library is loaded first too: the sanitizers catch its exceptions.
# Addresses are not random (setarch -R), for the thread sanitizer wants some of them for itself.
packages=$("$python" -c 'import sys; print(*(p for p in sys.path if p.endswith("site-packages")), sep=":")')
cd "$build/tree"
export PYTHONPATH="$PWD:$packages" ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1
export LD_PRELOAD="$loaded $(library stdc++)"
# shellcheck disable=SC2046,SC2086
exec setarch -R "$python" -S -m pytest -p no:cacheprovider --capture=sys $(printf 'tests/%s ' $tests)

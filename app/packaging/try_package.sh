#!/bin/bash
# What a user does with the package, in a folder of their own, with the package's files read-only. Run by
# scripts/package --try on a bare Debian.
set -e
cd
isochron --version

isochron run /usr/share/isochron/experiments/cube.yaml --set optimizer.iterations=3 --set target.samples=64
test -s runs/cube/final.png
test -s runs/cube/report.html

python3 - <<'END'
import isochron
cube = isochron.Experiment("/usr/share/isochron/experiments/cube.yaml", {"resolution": [16, 16]})
image = cube.render(samples=4)
assert image.shape[1:3] == (16, 16) and image.max() > 0, image.shape
loss, gradient = cube.loss_and_gradient([0.1])
assert loss > 0 and gradient.shape == (1,) and gradient[0] != 0, (loss, gradient)
print(isochron.__file__, image.shape)
END

man isochron-run | grep "optimise" >/dev/null
echo "manual: $(man -w isochron)"

source /usr/share/bash-completion/completions/isochron
COMP_WORDS=(isochron run --thr) COMP_CWORD=2
$(complete -p isochron | sed 's/.*-F \([^ ]*\).*/\1/')
test "${COMPREPLY[*]}" = --threads
echo "completion: ${COMP_WORDS[*]} -> ${COMPREPLY[*]}"

# Open MPI is not there: one line, status 2.
status=0
OMPI_COMM_WORLD_SIZE=1 OMPI_COMM_WORLD_RANK=0 isochron --version 2>message || status=$?
cat message
test $status = 2
test "$(wc -l <message)" = 1

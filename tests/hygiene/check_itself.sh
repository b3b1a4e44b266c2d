#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# check_itself.sh SCRATCH_FOLDER: each check passes a clean tree and names the file of each offence.
set -eu
checks=$(cd "$(dirname "$0")" && pwd)
scratch=$1
bad=0

clean_tree() {
  rm -rf "$scratch"
  mkdir -p "$scratch"
  cd "$scratch"
  mkdir -p include/sarnerf/core include/sarnerf/bake src/core src/geometry src/nerf/field src/nerf/train apps/sar_bench tests scripts cmake .ci data docs/method
  licence='// SPDX-License-Identifier: Apache-2.0'
  printf '%s\n#include <vector>\n#include <glm/glm.hpp>\n' "$licence" > include/sarnerf/core/a.h
  printf '%s\n// printed eq. 2\n' "$licence" > src/core/a.cpp
  printf '%s\n#include "sarnerf/core/a.h"\n' "$licence" > src/geometry/b.cpp
  printf '%s\n#include "field/c.h"\n' "$licence" > src/nerf/train/d.cpp
  echo "$licence" > src/nerf/field/c.h
  printf '| printed | where |\n|---|---|\n| 2 | `core/a.h`, `src/core/a.cpp` |\n' > docs/method/equations.md
  printf '#!/bin/sh\n# SPDX-License-Identifier: Apache-2.0\n# Reads a.h, then core/a.cpp.\n' > scripts/read.sh
  printf '%s\n// sar_bench speed\nf("speed"); add_subcommand("speed");\n' "$licence" > apps/sar_bench/main.cpp
  touch CMakeLists.txt CMakePresets.json
  echo 'See [equations](docs/method/equations.md).' > README.md
  printf '# The page\n\n## One heading, two\n\n[up](../README.md)\n' > docs/page.md
}

# offence CHECK FILE TEXT: appended to FILE, TEXT must make CHECK fail and name FILE.
offence() {
  clean_tree
  printf "$3\n" >> "$2"
  if report=$(sh "$checks/check_$1.sh" 2>&1); then
    echo "check_$1.sh accepted '$3' in $2"
    bad=1
  elif ! echo "$report" | grep -qF "$2"; then
    echo "check_$1.sh refused '$3' without naming $2: $report"
    bad=1
  fi
}

clean_tree
for check in docs equations files includes names; do
  sh "$checks/check_$check.sh" || { echo "check_$check.sh refused a clean tree"; bad=1; }
done

offence docs README.md '[a page](docs/none.md)'
offence docs README.md '[a heading](docs/page.md#two-headings)'
offence docs README.md "$(seq -s ' ' 50)"
offence docs README.md "$(seq -s '\n' 201)"
offence docs docs/page.md '[down](method/none.md#here)'
offence equations src/core/a.cpp '// printed eqs. 2, 99'
offence equations src/core/a.cpp '/// printed eqs. 2 and 35'
offence equations src/core/a.cpp '/// (printed 2–98)'
offence equations docs/method/equations.md '| 3 | learning half |'
offence equations docs/method/equations.md '| 3 | `core/a.h`, `core/none.h` |'
offence equations docs/method/equations.md '\n| 3 | form |\n|---|---|\n| 4 | `core/a.h` |'
offence includes include/sarnerf/bake/c.h '#include "sarnerf/nerf/model_file.h"'
offence includes src/core/a.cpp '#include "sarnerf/geometry/b.h"'
offence includes src/geometry/b.cpp '#include <sarnerf/render/b.h>'
offence includes src/nerf/field/c.h '#include "train/d.h"'
offence includes include/sarnerf/core/a.h '#include <opencv2/core.hpp>'
offence includes include/sarnerf/core/a.h '# include <stdio.h>'
offence names src/core/a.cpp '/// As src/core/none.cpp has it.'
offence names src/core/a.cpp '/// Measured with sar_bench memory.'
offence names scripts/read.sh '# See core/b.h'
offence names docs/method/equations.md 'The loop is in `none.cpp`.'
offence files src/core/new.cpp '// no licence'
offence files src/core/a.cpp "$(seq -s '\n' 701)"
# Put together here, or this line would be an offence itself.
offence files src/core/a.cpp "// see /$(echo home)/someone/mesh.obj"

# Forty files of 61 lines bear the four short ones of the clean tree, and no fifth.
clean_tree
for n in $(seq 60); do { echo "$licence"; seq 60; } > "src/core/story$n.cpp"; done
sh "$checks/check_shards.sh" || { echo "check_shards.sh refused a tree with few short files"; bad=1; }
echo "$licence" > src/core/shard.cpp
if report=$(sh "$checks/check_shards.sh"); then echo "check_shards.sh accepted a tenth of short files"; bad=1; fi
echo "$report" | grep -qF src/core/shard.cpp || { echo "check_shards.sh did not name the short file: $report"; bad=1; }

rm -rf "$scratch"
exit $bad

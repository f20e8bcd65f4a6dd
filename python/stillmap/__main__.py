# SPDX-License-Identifier: Apache-2.0
"""`python -m stillmap`: the command of this environment, or of the PATH."""
import os
import shutil
import sys
import sysconfig

command = shutil.which("stillmap", path=sysconfig.get_path("scripts")) or shutil.which("stillmap")
if command is None:
    sys.exit("error: the command stillmap is not installed\n  fix: install it into the same environment, or add its folder to PATH")
os.execv(command, [command, *sys.argv[1:]])

#!/usr/bin/env python3
"""Packs the add-on for Blender: python3 vdb_diffuse/blender/make_zip.py [OUT.zip], default vdb_diffuse_blender.zip.

One folder, vdb_diffuse/, in the zip serves Blender 3.4 (add-on) and 4.2 and later (extension).
"""
import os
import sys
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same sources give the same bytes


def pack(output):
    names = sorted(n for n in os.listdir(HERE) if n.endswith((".py", ".toml")) and n != os.path.basename(__file__))
    with zipfile.ZipFile(output, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in names:
            with open(os.path.join(HERE, name), "rb") as file:
                archive.writestr(zipfile.ZipInfo("vdb_diffuse/" + name, EPOCH), file.read(), zipfile.ZIP_DEFLATED)


if __name__ == "__main__":
    if len(sys.argv) > 2 or sys.argv[1:] in (["-h"], ["--help"]):
        sys.exit(__doc__)
    target = sys.argv[1] if len(sys.argv) > 1 else "vdb_diffuse_blender.zip"
    pack(target)
    print(target)

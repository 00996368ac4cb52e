"""Execute the notebooks beside this file and keep what they show: `make notebook`. Run: execute.py [folder for the results]."""

import sys
from pathlib import Path

import nbclient
import nbformat

HERE = Path(__file__).parent
folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE

for path in sorted(HERE.glob("*.ipynb")):
    notebook = nbformat.read(path, as_version=4)
    # no times of execution among the results, so that only a change shows as one
    nbclient.NotebookClient(notebook, record_timing=False, resources={"metadata": {"path": str(HERE)}}).execute()
    nbformat.write(notebook, folder / path.name)

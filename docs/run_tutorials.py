"""Run the tutorials and keep what their cells print, which the pages show.

python docs/run_tutorials.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

TUTORIALS = Path(__file__).parent / "tutorials"


def run(file: Path, folder: str) -> nbformat.NotebookNode:
    """A notebook with what its cells printed; CellExecutionError where one of them raised."""
    notebook = nbformat.read(file, as_version=4)
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": folder}}).execute()
    for cell in notebook.cells:
        cell.metadata = {}
        for output in cell.get("outputs", ()):
            output.pop("execution_count", None)
        if cell.cell_type == "code":
            cell.execution_count = None
            cell.outputs = [o for o in cell.outputs if o.output_type == "stream"]
    notebook.metadata.pop("language_info", None)
    return notebook


if __name__ == "__main__":
    for file in sorted(TUTORIALS.glob("*.ipynb")):
        with tempfile.TemporaryDirectory() as folder:
            nbformat.write(run(file, folder), file)
        print(f"{file.name}: run")

"""The bench in the browser: bring measurements, fit them, see the answer, in pages that this machine serves to itself alone.

Pages ask the functions that the command line asks, and say what it says: nothing is read, fitted or worded here. The pages are
loaded when `bowdenfit app` runs, because NiceGUI is large.
"""

import os
from pathlib import Path

import lazy_loader as lazy

# NiceGUI reads a folder `.nicegui` of the working folder when it is imported; the app stores nothing, and names a missing one.
os.environ["NICEGUI_STORAGE_PATH"] = str(Path(__file__).parent / "storage")

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)

"""Files as laboratories write them: tables of readings, and recordings of any acquisition program.

`read_channels` reads a recording, `tables.read_table` a table; `columns` and `headings` find the quantities in them. A
format of recordings is a module with `read(path)` and a line in `FORMATS`.
"""

from bowdenfit.files.formats import FORMATS, check_ending, is_ros2_folder, read_channels, read_here

__all__ = ["FORMATS", "check_ending", "is_ros2_folder", "read_channels", "read_here"]

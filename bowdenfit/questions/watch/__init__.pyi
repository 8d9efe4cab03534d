from . import history_figure as history_figure
from .answer import History as History
from .answer import UnreadableFiles as UnreadableFiles
from .answer import WatchedAnswer as WatchedAnswer
from .watching import watch_answers as watch_answers
from .words import describe_answer as describe_answer
from .words import describe_verdict as describe_verdict
from .words import watch_lines as watch_lines

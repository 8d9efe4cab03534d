"""Good input made bad: one thing replaced by another, in text that must hold it."""


def replaced(text, *changes):
    """A text with each old part replaced by its new one."""
    for old, new in changes:
        assert old in text, f"there is no {old!r} to spoil"
        text = text.replace(old, new)
    return text


def spoil(path, old, new):
    """Replace a part of a file."""
    path.write_text(replaced(path.read_text(encoding="utf-8"), (old, new)), encoding="utf-8")


def copied(source, names, folder):
    """Files of a data set in a folder of their own, made for them."""
    folder.mkdir()
    for name in names:
        (folder / name).write_bytes((source / name).read_bytes())
    return folder

"""Workbooks with the sheets that a test wants."""

import openpyxl


def write_workbook(path, sheets):
    """Write a workbook of sheets by title, each as rows of cells; return its path."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path

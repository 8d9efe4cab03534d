"""Add-ons that come with bowdenfit, a folder each. The core imports none of them: it finds them by their entry points.

Type checkers see in `__init__.pyi` which functions `bowdenfit` has of them.
"""

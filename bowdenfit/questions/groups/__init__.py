"""Do groups of readings differ in friction?"""

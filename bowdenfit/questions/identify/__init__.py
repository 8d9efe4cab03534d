"""What do the measurements determine?"""

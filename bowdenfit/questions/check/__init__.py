"""Do data set and fit make sense, reading by reading?"""

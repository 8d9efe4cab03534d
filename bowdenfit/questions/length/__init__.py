"""Which length is best?"""

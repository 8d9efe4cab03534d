"""Which of several models predicts the measurements best?"""

"""What do recordings say, sample by sample?"""

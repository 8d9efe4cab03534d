"""How much of a cable's friction may a controller hide?"""

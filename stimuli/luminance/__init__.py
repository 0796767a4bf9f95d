"""How bright a picture is, and how bright it is made: factors, grey, tone mapping and statistics."""

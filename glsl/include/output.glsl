// Where in the view a pixel of the host's output is, of which the view may be a part.
vec2 view_position() { return gl_FragCoord.xy - frame.output_origin; }

uniform vec2 depth_to_view;  // distance along the view axis = x / (y - depth)

float view_distance(float depth) { return depth_to_view.x / max(depth_to_view.y - depth, 1e-7); }

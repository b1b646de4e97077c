// What a body covers.
flat in uint body;
out uint covered;

void main() { covered = body; }

#include "render/scene_renderer.h"

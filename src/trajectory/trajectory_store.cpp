#include "trajectory/trajectory.h"
